// A data set with a name: a file under version control that says all its pixels follow from, and what must come out.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tracer/generate.hpp"

namespace clerestory {

/// Means over the pixels of a view, by which those of another device are known to be the same.
enum class ViewMean { Albedo, Roughness, Metallic, NormalX, NormalY, NormalZ, Depth, Radiance, Light };
inline constexpr int kViewMeans = 9;
/// The key of its numbers in a manifest: "albedo".
const char* key_of(ViewMean mean);

struct MeanWithin {
  double value = 0, within = 0;  // and how far another device's may lie from it
};
using ViewMeans = std::array<MeanWithin, kViewMeans>;

struct SetSplit {
  std::string name;  // train, val or test: its list, and the folder of the set that holds it
  int rooms = 0;
  std::uint64_t seed = 0;
  Setting setting = Setting::Training;
  // What must come out.
  std::string rooms_hash;        // hash_of(RoomFile)
  std::vector<int> cameras;      // of each view of each room the candidate that it is (chosen_views)
  std::vector<ViewMeans> views;  // of the first views
};

struct Manifest {
  std::filesystem::path file;
  std::string name;
  int version = 1;
  ViewChoice views;
  LightWanted light;
  std::vector<SetSplit> splits;
  int expected_version = 0;  // for which all that must come out was written; 0: it is not there
  std::string assets_hash;   // hash_of_assets
};

/// A relative name is looked for as configs are. Throws usage_error naming file and line, key, value and what was
/// expected: a key that is missing, unknown, of another type or out of range, two splits of the same rooms, lists of
/// other lengths, what must come out of another version. Of what must come out only the version is read, if it is
/// there, where `expected` is false.
Manifest read_manifest(const std::filesystem::path& file, bool expected = true);
/// The text of a manifest with what must come out; the comment that its file begins with stays.
std::string manifest_text(const Manifest& manifest);

/// Of all numbers and names in the descriptions.
std::string hash_of(const RoomFile& rooms);

}  // namespace clerestory
