#include "nets/constant_light.hpp"

#include "nets/render_scene.hpp"

namespace clerestory {

std::array<double, 3> fit_level(Device& device, const Scene& scene, RenderSettings settings) {
  settings.level.reset(), settings.lamps.clear();
  const Image unit = render_scene(device, scene, settings).radiance;
  const std::size_t n = unit.pixels();
  const auto used = [&](std::size_t c, std::size_t i) {  // what is not shaded is black whatever the light
    return scene.material.data[2 * n + i] == 0 && unit.data[c * n + i] > 0;
  };
  std::array<double, 3> fitted{};
  for (std::size_t c = 0; c < 3; ++c) {
    double whole = 0, count = 0, product = 0, squares = 0;
    for (std::size_t i = 0; i < n; ++i)
      if (used(c, i)) whole += static_cast<double>(scene.photo.data[c * n + i]), count += 1;
    if (whole <= 0) continue;
    for (std::size_t i = 0; i < n; ++i) {
      if (!used(c, i)) continue;
      const auto seen = static_cast<double>(scene.photo.data[c * n + i]),
                 lit = static_cast<double>(unit.data[c * n + i]);
      const double weight = weight_of_pixel(seen, whole / count, settings.fit);
      product += weight * weight * lit * seen, squares += weight * weight * lit * lit;
    }
    if (squares > 0) fitted[c] = product / squares;
  }
  return fitted;
}

std::array<double, 3> fit_constant(Device& device, const Scene& scene, RenderSettings settings) {
  settings.light = "constant", settings.constant = {1, 1, 1};
  return fit_level(device, scene, std::move(settings));
}

}  // namespace clerestory
