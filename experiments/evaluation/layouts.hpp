// Generated rooms as IIW, NYUv2 or OpenRooms lie on disk, so that readers, metrics and trainings of those run without a
// download.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "host/io/iiw.hpp"
#include "host/io/image.hpp"

namespace clerestory {

/// Judgements of neighbours in a grid of points, one at a pixel drawn from `seed` in each cell of a tenth of the longer
/// side that has a pixel with `usable` above 0.5. They say what the linear albedo says, each with weight 1; where its
/// display values say otherwise nobody agrees (darker is null). So its WHDR is 0 by both conventions.
Judgements judgements_of(const Image& albedo, const Image& usable, std::uint64_t seed);

/// Throws usage_error where <rooms>/<layout> is there already and not empty.
void check_layout_is_new(const std::filesystem::path& rooms, const std::string& layout);

/// Writes every view of the lists in `rooms` as "iiw", "nyu" or "openrooms" into the folder of that name in it, which
/// appears whole or not at all. Pictures are clipped at white, and 8 bits but for OpenRooms.
///   iiw        <room>_<NNN>.png and .json, of true albedo where nothing is emitted
///   nyu        one file (kept in memory until it is written), normals, masks, and the lists as numbers; depth 0 where
///              there is none
///   openrooms  main_xml/<room>, view NNN as NNN + 1, and the lists. Light, where a view has it: each of its points
///              stands for the pixels around it, each of its directions for 2 x 2
/// `progress(done, total)` is called after each view, and may throw.
void write_layout(const std::filesystem::path& rooms, const std::string& layout,
                  const std::function<void(int, int)>& progress = {});

}  // namespace clerestory
