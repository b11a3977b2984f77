#include "experiments/truth/traced_room.hpp"

#include <algorithm>

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

}  // namespace clerestory
