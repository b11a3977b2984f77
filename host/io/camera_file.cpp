#include "host/io/camera_file.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "host/io/json_file.hpp"

namespace clerestory {
namespace {

using Json = nlohmann::json;

const Json& member(const Json& json, const char* key, const std::string& where) {
  const auto found = json.find(key);
  if (found == json.end()) throw usage_error(fmt::format("the key {} is missing", key), where);
  return *found;
}

double number(const Json& value, const std::string& key, const std::string& where) {
  if (!value.is_number()) throw usage_error("wrong value of " + key, where, brief(value), "a number");
  return value.get<double>();
}

int pixels(const Json& json, const char* key, const std::string& where) {
  const Json& value = member(json, key, where);
  if (!value.is_number_integer() || value.get<double>() < 1 ||
      value.get<double>() > static_cast<double>(max_image_values))
    throw usage_error(fmt::format("wrong value of {}", key), where, brief(value), "a positive whole number of pixels");
  return value.get<int>();
}

std::optional<double> positive(const Json& json, const char* key, const std::string& where) {
  if (!json.contains(key)) return std::nullopt;
  const double value = number(json[key], key, where);
  if (!(value > 0)) throw usage_error(fmt::format("wrong value of {}", key), where, brief(json[key]), "above 0");
  return value;
}

template <std::size_t N>
std::array<double, N> numbers(const Json& value, const std::string& key, const std::string& where) {
  if (!value.is_array() || value.size() != N)
    throw usage_error("wrong value of " + key, where, brief(value), fmt::format("{} numbers", N));
  std::array<double, N> out;
  for (std::size_t i = 0; i < N; ++i) out[i] = number(value[i], fmt::format("{}[{}]", key, i), where);
  return out;
}

// Files of RGB-D benchmarks put pixel centres at whole numbers, and only such files have these keys.
void convert_rgbd(const Json& json, CameraFile& file, const std::string& where) {
  if (json.contains("depth_kind") && json["depth_kind"] != "axial")
    throw usage_error("wrong value of depth_kind", where, brief(json["depth_kind"]), "\"axial\"");
  file.integer_centres = true;
  file.camera.cx += 0.5, file.camera.cy += 0.5;
  if (!json.contains("distortion") || json["distortion"].is_null()) return;
  const auto distortion = numbers<5>(json["distortion"], "distortion", where);
  if (std::any_of(distortion.begin(), distortion.end(), [](double k) { return k != 0; })) file.distortion = distortion;
}

}  // namespace

CameraFile read_camera(const std::filesystem::path& path) {
  const std::string where = path.string();
  const Json json = read_json_object(path);
  CameraFile file;
  Camera& camera = file.camera;
  camera.width = pixels(json, "width", where), camera.height = pixels(json, "height", where);
  for (auto [key, value] : {std::pair{"fx", &camera.fx}, {"fy", &camera.fy}, {"cx", &camera.cx}, {"cy", &camera.cy}})
    *value = number(member(json, key, where), key, where);
  file.has_pose = json.contains("camera_to_world");
  if (file.has_pose) camera.camera_to_world = numbers<16>(json["camera_to_world"], "camera_to_world", where);
  file.exposure = positive(json, "exposure", where);
  file.baseline = positive(json, "baseline_m", where);
  if (json.contains("distortion") || json.contains("depth_kind")) convert_rgbd(json, file, where);
  camera.check(where);
  return file;
}

void write_camera(const std::filesystem::path& path, const Camera& camera, std::optional<double> exposure) {
  camera.check(path.string());
  nlohmann::ordered_json json{{"width", camera.width},
                              {"height", camera.height},
                              {"fx", camera.fx},
                              {"fy", camera.fy},
                              {"cx", camera.cx},
                              {"cy", camera.cy},
                              {"camera_to_world", camera.camera_to_world}};
  if (exposure) json["exposure"] = *exposure;
  write_file(path, json.dump(1) + "\n");
}

}  // namespace clerestory
