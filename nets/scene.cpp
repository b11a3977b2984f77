#include "nets/scene.hpp"

#include <algorithm>

#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr float kSaturated = 0.98f;
constexpr double kLeastRegion = 0.0002;  // of the picture
constexpr double kLampOverRoom = 10;     // times the 95th percentile of luminance

/// The bright pixels that hang together with `start`; they are taken out of `bright`.
std::vector<int> region_of(int start, int width, int height, std::vector<bool>& bright) {
  std::vector<int> region{start};
  bright[static_cast<std::size_t>(start)] = false;
  for (std::size_t next = 0; next < region.size(); ++next) {
    const int x = region[next] % width, y = region[next] / width;
    const auto visit = [&](int nx, int ny) {
      if (nx < 0 || ny < 0 || nx >= width || ny >= height) return;
      const int i = ny * width + nx;
      if (!bright[static_cast<std::size_t>(i)]) return;
      bright[static_cast<std::size_t>(i)] = false;
      region.push_back(i);
    };
    visit(x - 1, y), visit(x + 1, y), visit(x, y - 1), visit(x, y + 1);
  }
  return region;
}

/// 1 in the regions of bright pixels that are large enough.
Image flags_of(std::vector<bool> bright, int width, int height) {
  Image flags(width, height, 1);
  const auto least = kLeastRegion * static_cast<double>(flags.pixels());
  for (std::size_t i = 0; i < flags.pixels(); ++i) {
    if (!bright[i]) continue;
    const std::vector<int> region = region_of(static_cast<int>(i), width, height, bright);
    if (static_cast<double>(region.size()) <= least) continue;
    for (const int pixel : region) flags.data[static_cast<std::size_t>(pixel)] = 1;
  }
  return flags;
}

void check_map(const Image& map, int channels, const Scene& scene, const std::string& what, const std::string& where) {
  if (map.width == scene.width() && map.height == scene.height() && map.channels == channels) return;
  if (map.data.empty()) throw usage_error("there is no map '" + what + "'", where);
  throw usage_error("the map '" + what + "' has another size than the camera", where,
                    fmt::format("{}x{} with {} channels", map.width, map.height, map.channels),
                    fmt::format("{}x{} with {}", scene.width(), scene.height(), channels));
}

}  // namespace

double Scene::scale() const { return scene_scale(depth.data); }

void Scene::check(const std::string& where) const {
  check_map(photo, 3, *this, "photo", where);
  check_map(albedo, 3, *this, "albedo", where);
  check_map(normal, 3, *this, "normal", where);
  check_map(depth, 1, *this, "depth", where);
  check_map(material, 3, *this, "material", where);
}

Scene scene_of(const RoomView& view, const std::string& where) {
  if (!view.camera || !view.emission) throw usage_error("not a generated view: no camera or no emission", where);
  Scene scene;
  scene.camera = *view.camera, scene.photo = view.image, scene.albedo = view.albedo, scene.normal = view.normal;
  scene.depth = view.depth, scene.material = view.material;
  const std::size_t n = scene.photo.pixels();
  const std::vector<float>& emitted = view.emission->data;
  for (std::size_t i = 0; i < n; ++i)
    scene.material.data[2 * n + i] = emitted[i] > 0 || emitted[n + i] > 0 || emitted[2 * n + i] > 0 ? 1.0f : 0.0f;
  return scene;
}

Image emission_flags(const Image& photo) {
  const std::size_t n = photo.pixels();
  std::vector<bool> bright(n);
  for (std::size_t i = 0; i < n; ++i)
    bright[i] = photo.data[i] >= kSaturated && photo.data[n + i] >= kSaturated && photo.data[2 * n + i] >= kSaturated;
  return flags_of(std::move(bright), photo.width, photo.height);
}

Image lamp_flags(const Image& radiance) {
  const std::size_t n = radiance.pixels();
  const std::vector<float>& v = radiance.data;
  const double least = kLampOverRoom * luminance_quantile(v, 0.95);
  std::vector<bool> bright(n);
  for (std::size_t i = 0; i < n; ++i) bright[i] = least > 0 && luminance(v[i], v[n + i], v[2 * n + i]) >= least;
  return flags_of(std::move(bright), radiance.width, radiance.height);
}

double emitting_share(const Image& material) {
  const float* flag = material.plane(2);
  return static_cast<double>(std::count(flag, flag + material.pixels(), 1.0f)) / static_cast<double>(material.pixels());
}

}  // namespace clerestory
