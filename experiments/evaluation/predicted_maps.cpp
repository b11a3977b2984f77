#include "experiments/evaluation/predicted_maps.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/error.hpp"
#include "host/io/finite.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// The file of a map, or nothing.
std::optional<fs::path> file_of(const fs::path& root, const std::string& name, const std::string& map) {
  std::vector<std::string> extensions{".exr"};
  if (map == "albedo") extensions.push_back(".png");
  for (const std::string& extension : extensions)
    for (const fs::path& file : {root / name / (map + extension), root / (name + "_" + map + extension)})
      if (fs::is_regular_file(file)) return file;
  return std::nullopt;
}

Image decoded_albedo(const fs::path& file, AlbedoCode code) {
  Image albedo = read_map(file, 3);
  check_finite(albedo, file);
  for (float& v : albedo.data) {
    v = std::clamp(v, 0.0f, 1.0f);
    if (code == AlbedoCode::Srgb) v = std::pow(v, 2.2f);
  }
  return albedo;
}

Image unit_normals(const fs::path& file) {
  Image normal = read_map(file, 3);
  std::size_t some = 0, odd = 0;
  for (std::size_t i = 0; i < normal.pixels(); ++i) {
    double squares = 0;
    for (int c = 0; c < 3; ++c) squares += std::pow(normal.plane(c)[i], 2.0);
    if (!std::isfinite(squares))
      for (int c = 0; c < 3; ++c) normal.plane(c)[i] = 0;
    else if (squares > 0)
      ++some, odd += std::abs(std::sqrt(squares) - 1) > 0.1;
  }
  if (odd > some / 10)
    throw usage_error("the normals are not unit vectors", file.string(),
                      fmt::format("{} of {} are off by over 0.1", odd, some),
                      "camera space, each component in [-1, 1]");
  return normal;
}

/// Over its maximum: protocols fit a scale within bounds that millimetres would leave.
Image relative_depth(const fs::path& file) {
  Image depth = read_map(file, 1);
  float most = 0;
  for (float& d : depth.data) {
    if (!(d > 0) || !std::isfinite(d)) d = 0;
    most = std::max(most, d);
  }
  for (float& d : depth.data) d = most > 0 ? d / most : 0;
  return depth;
}

Image finite_material(const fs::path& file) {
  Image material = read_map(file, 3);
  for (int c = 0; c < 2; ++c)
    for (std::size_t i = 0; i < material.pixels(); ++i)
      if (!std::isfinite(material.plane(c)[i]))
        throw usage_error("a value is not finite", file.string(), fmt::format("{}", material.plane(c)[i]));
  return material;
}

}  // namespace

AlbedoCode albedo_code(const std::string& word) { return word == "srgb" ? AlbedoCode::Srgb : AlbedoCode::Linear; }

PredictedMaps read_predicted(const fs::path& root, const std::string& name, AlbedoCode code) {
  PredictedMaps maps;
  if (const auto file = file_of(root, name, "albedo")) maps.albedo = decoded_albedo(*file, code);
  if (const auto file = file_of(root, name, "normal")) maps.normal = unit_normals(*file);
  if (const auto file = file_of(root, name, "depth")) maps.depth = relative_depth(*file);
  if (const auto file = file_of(root, name, "material")) maps.material = finite_material(*file);
  if (!maps.albedo && !maps.normal && !maps.depth && !maps.material)
    throw usage_error("holds no map of " + name, root.string(), {},
                      fmt::format("{0}/albedo.exr, normal, depth or material, or {0}_albedo.exr", name));
  return maps;
}

void check_same_kinds(const PredictedMaps& maps, const PredictedMaps& first, const std::string& name) {
  const auto same = [&](const std::optional<Image>& map, const std::optional<Image>& of_first, const char* kind) {
    if (map.has_value() != of_first.has_value())
      throw usage_error("not the same kinds of maps as of the first picture", name,
                        fmt::format("{} {}", map ? "a map of" : "no", kind));
  };
  same(maps.albedo, first.albedo, "albedo"), same(maps.normal, first.normal, "normal");
  same(maps.depth, first.depth, "depth"), same(maps.material, first.material, "material");
}

}  // namespace clerestory
