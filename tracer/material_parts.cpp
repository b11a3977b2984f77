#include "tracer/material_parts.hpp"

#include <algorithm>
#include <cmath>

namespace clerestory {
namespace {

/// With a texture's tint the albedo stays above 0.02.
constexpr float kDarkest = 0.028f;

}  // namespace

glm::vec3 hsv(float hue, float saturation, float value) {
  glm::vec3 rgb;
  for (int c = 0; c < 3; ++c) {
    const float k = std::fmod(hue * 6 + (c == 0 ? 5.f : c == 1 ? 3.f : 1.f), 6.f);
    const float v = value - value * saturation * std::clamp(std::min(k, 4.f - k), 0.f, 1.f);
    rgb[c] = std::pow(v, 2.2f);
  }
  return rgb;
}

glm::vec3 grey(float value) { return glm::vec3(std::pow(value, 2.2f)); }

Material textured(Texture texture, Random& random) {
  Material m;
  m.texture = static_cast<float>(texture);
  m.seed = static_cast<float>(random.whole(0, 4095));
  return m;
}

void colors(Material& m, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  m.color_a = glm::max(a, kDarkest), m.color_b = glm::max(b, kDarkest), m.color_c = glm::max(c, kDarkest);
}

void roughness(Material& m, float a, float b, float c) { m.roughness_a = a, m.roughness_b = b, m.roughness_c = c; }

}  // namespace clerestory
