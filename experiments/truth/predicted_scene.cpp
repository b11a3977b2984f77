#include "experiments/truth/predicted_scene.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/applications/predict.hpp"

namespace clerestory {

Image camera_picture(const Image& exposed) {
  Image picture = exposed;
  for (float& v : picture.data) {
    const double shown = std::round(255 * std::pow(std::clamp(static_cast<double>(v), 0.0, 1.0), 1 / 2.2));
    v = static_cast<float>(std::pow(shown / 255, 2.2));
  }
  return picture;
}

Scene predicted_scene(Device& device, const std::filesystem::path& weights, const Image& photo, const Camera& camera,
                      bool clipped) {
  Prediction maps = predict_maps(device, weights, photo, {});
  Scene scene{camera, photo, maps.albedo, maps.normal, maps.depth, maps.material};
  const Image flags = clipped ? emission_flags(photo) : Image(photo.width, photo.height, 1);
  std::ranges::copy(flags.data, scene.material.plane(2));
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
