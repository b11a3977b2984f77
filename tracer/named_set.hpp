// The data set of a manifest on disk: DIR/train.rooms describes the rooms of a split, DIR/train is its folder as
// generate() makes it of them; so with val and test.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "tracer/manifest.hpp"

namespace clerestory {

/// So many rooms, the first of a split, have their means in a manifest.
inline constexpr int kMeasuredRooms = 4;

/// <dir>/<split>.rooms.
std::filesystem::path rooms_of_split(const std::filesystem::path& dir, const SetSplit& split);
/// What generate() is to be told of a split.
GenerateOptions options_of(const Manifest& manifest, const SetSplit& split, const std::filesystem::path& dir);

/// The rooms of a split as the rules make them now, with the cameras that the split names. On no device. `each` is
/// called with the number of rooms that are done.
RoomFile make_rooms(const Manifest& manifest, const SetSplit& split, const RoomAssets& assets,
                    const std::function<void(int)>& each = {});
/// Which candidates the split's cameras are to be, judged by what a device traces.
std::vector<int> choose_cameras(const Device& device, const Manifest& manifest, const SetSplit& split,
                                const RoomAssets& assets, const std::function<void(int)>& each = {});

/// Means over a view on disk, and how far another device's may lie from them. Of a map: a step of half, 2^-10
/// of the mean of |values|, and a thousandth of the pixels, which see another surface beside an edge: some ten
/// roundings move a ray by 10 x 2^-24 of the picture's width, 2e-4 of a pixel at 320 columns, so that even where every
/// pixel has an edge fewer change sides. Of radiance (without exposure): a step of half, and five standard deviations
/// of the difference of two means of independent samples, though a device that draws the same random numbers is far
/// nearer. Throws usage_error naming a file that cannot be read.
ViewMeans measure_view(const std::filesystem::path& room, const std::string& id, bool light);

/// Says by file what makes the folder another set than the manifest's first `rooms` rooms of a split: rooms of another
/// hash, other options, rooms and views that are missing or too many, files that a view lacks, means of the first views
/// beyond what another device may change.
void check_split(const Manifest& manifest, const SetSplit& split, const std::filesystem::path& dir, int rooms,
                 const std::function<void(const std::filesystem::path& file, const std::string& what)>& problem);

}  // namespace clerestory
