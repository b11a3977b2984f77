#include "nets/scene.hpp"

#include <algorithm>

#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr float kSaturated = 0.98f;
constexpr double kLeastRegion = 0.0002;  // of the picture

bool saturated(const Image& photo, std::size_t i) {
  const std::size_t n = photo.pixels();
  return photo.data[i] >= kSaturated && photo.data[n + i] >= kSaturated && photo.data[2 * n + i] >= kSaturated;
}

/// The saturated pixels that hang together with `start`; they are marked in `seen`.
std::vector<int> region_of(const Image& photo, int start, std::vector<bool>& seen) {
  std::vector<int> region{start};
  seen[static_cast<std::size_t>(start)] = true;
  for (std::size_t next = 0; next < region.size(); ++next) {
    const int x = region[next] % photo.width, y = region[next] / photo.width;
    const auto visit = [&](int nx, int ny) {
      if (nx < 0 || ny < 0 || nx >= photo.width || ny >= photo.height) return;
      const int i = ny * photo.width + nx;
      if (seen[static_cast<std::size_t>(i)] || !saturated(photo, static_cast<std::size_t>(i))) return;
      seen[static_cast<std::size_t>(i)] = true;
      region.push_back(i);
    };
    visit(x - 1, y), visit(x + 1, y), visit(x, y - 1), visit(x, y + 1);
  }
  return region;
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
  Image flags(photo.width, photo.height, 1);
  std::vector<bool> seen(photo.pixels(), false);
  const auto least = kLeastRegion * static_cast<double>(photo.pixels());
  for (std::size_t i = 0; i < photo.pixels(); ++i) {
    if (seen[i] || !saturated(photo, i)) continue;
    const std::vector<int> region = region_of(photo, static_cast<int>(i), seen);
    if (static_cast<double>(region.size()) <= least) continue;
    for (const int pixel : region) flags.data[static_cast<std::size_t>(pixel)] = 1;
  }
  return flags;
}

double emitting_share(const Image& material) {
  const float* flag = material.plane(2);
  return static_cast<double>(std::count(flag, flag + material.pixels(), 1.0f)) / static_cast<double>(material.pixels());
}

}  // namespace clerestory
