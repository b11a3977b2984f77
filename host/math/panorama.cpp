#include "host/math/panorama.hpp"

#include <cmath>
#include <glm/gtc/constants.hpp>
#include <numbers>

namespace clerestory {

Vec2 panorama_position(const Vec3& d) {
  const double horizontal = std::hypot(d.x, d.z);
  const double azimuth = horizontal > 0 ? std::atan2(d.x, -d.z) : 0;
  // atan2 keeps its accuracy at the poles, where acos(y) loses half the digits.
  return {0.5 + azimuth / glm::two_pi<double>(), std::atan2(horizontal, d.y) / glm::pi<double>()};
}

Vec3 panorama_direction(const Vec2& uv) {
  const double azimuth = (uv.x - 0.5) * glm::two_pi<double>(), polar = uv.y * glm::pi<double>();
  return {std::sin(polar) * std::sin(azimuth), std::cos(polar), -std::sin(polar) * std::cos(azimuth)};
}

Vec3 panorama_direction(int column, int row, int columns, int rows) {
  return panorama_direction(Vec2((column + 0.5) / columns, (row + 0.5) / rows));
}

double panorama_solid_angle(int row, int columns, int rows) {
  const double top = glm::pi<double>() * row / rows, bottom = glm::pi<double>() * (row + 1) / rows;
  // cos(top) - cos(bottom) as a product: no cancellation near the poles.
  return glm::two_pi<double>() / columns * 2 * std::sin((top + bottom) / 2) * std::sin((bottom - top) / 2);
}

Vec3 lattice_direction(int i, int count) {
  const double y = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - y * y),
               turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
  return {r * std::cos(turn), y, r * std::sin(turn)};
}

}  // namespace clerestory
