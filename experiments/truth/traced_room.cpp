#include "experiments/truth/traced_room.hpp"

#include <algorithm>

#include "host/io/image.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {

Scene scene_of(const TraceMaps& maps, const Camera& camera) {
  Scene scene;
  scene.camera = camera, scene.albedo = maps.albedo, scene.normal = maps.normal, scene.depth = maps.depth;
  scene.material = Image(camera.width, camera.height, 3);
  std::copy(maps.roughness.data.begin(), maps.roughness.data.end(), scene.material.plane(0));
  std::copy(maps.metallic.data.begin(), maps.metallic.data.end(), scene.material.plane(1));
  std::transform(maps.emitter.begin(), maps.emitter.end(), scene.material.plane(2),
                 [](int emitter) { return emitter >= 0 ? 1.0f : 0.0f; });
  return scene;
}

std::vector<bool> pixels_with_depth(const Scene& scene) {
  std::vector<bool> with;
  for (const float depth : scene.depth.data) with.push_back(depth > 0);
  return with;
}

void TracedRoom::take_photograph(int spp, std::uint32_t seed) {
  const Image linear = traced.picture(camera, spp, seed).mean;
  scene.photo = scaled(linear, exposure_of(linear.data));
}

}  // namespace clerestory
