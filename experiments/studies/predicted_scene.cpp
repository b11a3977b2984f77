#include "experiments/studies/predicted_scene.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/applications/predict.hpp"

namespace clerestory {

Scene predicted_scene(Device& device, const std::filesystem::path& weights, const Scene& truth) {
  Prediction maps = predict_maps(device, weights, truth.photo, {});
  Scene scene{truth.camera, truth.photo, maps.albedo, maps.normal, maps.depth, maps.material};
  std::fill_n(scene.material.plane(2), scene.material.pixels(), 0.0f);
  const double factor = maps.scene_scale / scene.scale();
  for (float& d : scene.depth.data) d = static_cast<float>(d * factor);
  return scene;
}

void scale_depth(Scene& scene, const Vec2& at, double metres) {
  const int x = static_cast<int>(std::floor(at.x)), y = static_cast<int>(std::floor(at.y));
  if (x < 0 || y < 0 || x >= scene.width() || y >= scene.height()) return;
  const double factor = metres / static_cast<double>(scene.depth.at(0, y, x));
  if (!(factor > 0) || !std::isfinite(factor)) return;
  for (float& d : scene.depth.data) d = static_cast<float>(d * factor);
}

}  // namespace clerestory
