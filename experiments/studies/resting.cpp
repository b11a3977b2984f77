#include "experiments/studies/resting.hpp"

namespace clerestory {

InsertedObject resting_on(const Scene& scene, const Scene& known, InsertedObject object) {
  auto& c = *object.at_point;
  const Vec3 below = object.radius.value_or(0) * known.camera.direction_to_camera({0, 1, 0});
  const std::optional<Vec2> at = known.camera.project(Vec3(c[0], c[1], c[2]) - below);
  if (!at || at->x < 0 || at->y < 0 || at->x >= known.width() || at->y >= known.height()) return object;
  const auto x = static_cast<int>(at->x), y = static_cast<int>(at->y);
  const auto predicted = static_cast<double>(scene.depth.at(0, y, x)),
             truth = static_cast<double>(known.depth.at(0, y, x));
  if (!(predicted > 0 && truth > 0)) return object;
  for (double& v : c) v *= predicted / truth;
  for (std::optional<double>* length : {&object.radius, &object.size})
    if (*length) **length *= predicted / truth;
  return object;
}

}  // namespace clerestory
