// Maps that any method predicted, in a folder for all pictures of a data set.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "host/io/image.hpp"

namespace clerestory {

/// Each of a size of its own. Albedo: linear. Normals: camera space, [-1, 1], 0 for none. Depth: in a unit
/// of its own, 0 for none. Material: roughness, metallic and whatever else.
struct PredictedMaps {
  std::optional<Image> albedo = {}, normal = {}, depth = {}, material = {};
};

/// How a method's albedo is stored. Srgb: v^(1/2.2) of the linear albedo, the exponent of the scripts that judge it.
enum class AlbedoCode { Linear, Srgb };
AlbedoCode albedo_code(const std::string& word);  // "linear", "srgb"

/// Maps of the picture `name` ("5", "room/000"): albedo, normal, depth, material in the folder root/name, as in a
/// run's, or root/name_albedo and so on, as in a data set. All are EXR; an albedo may be PNG. An albedo is clamped to
/// [0, 1]; depths come over their maximum, whatever their unit, 0 where they are negative or not finite; normals that
/// are not finite are 0. Throws usage_error where none is there, and naming the file where an albedo or a material is
/// not finite, or normals are no unit vectors (more than a tenth of them off by 0.1).
PredictedMaps read_predicted(const std::filesystem::path& root, const std::string& name, AlbedoCode code);

/// Throws usage_error naming the picture where another kind of map is there than of the first one: means would be over
/// other pictures.
void check_same_kinds(const PredictedMaps& maps, const PredictedMaps& first, const std::string& name);

}  // namespace clerestory
