#include "host/math/frames.hpp"

#include <cmath>
#include <glm/gtc/constants.hpp>

namespace clerestory {
namespace {

constexpr double pole_cosine = 0.999;  // |up.n| above which the other up is taken

double elevation(int row, int rows) { return (row + 0.5) / rows * glm::half_pi<double>(); }

}  // namespace

Frame frame_around(const Vec3& n) {
  const double sign = std::copysign(1.0, n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

Frame hemisphere_frame(const Vec3& n) {
  const Vec3 up = std::abs(n.y) > pole_cosine ? Vec3(0, 0, 1) : Vec3(0, 1, 0);
  const Vec3 y = glm::normalize(up - glm::dot(up, n) * n);
  return {-glm::normalize(glm::cross(y, n)), y, n};
}

Vec3 hemisphere_direction(int row, int column, int rows, int columns) {
  const double azimuth = ((column + 0.5) / columns - 0.5) * glm::two_pi<double>(), el = elevation(row, rows);
  return {std::sin(el) * std::cos(azimuth), std::sin(el) * std::sin(azimuth), std::cos(el)};
}

double hemisphere_weight(int row, int rows, int columns) {
  return std::sin(elevation(row, rows)) * glm::pi<double>() * glm::pi<double>() / (static_cast<double>(rows) * columns);
}

}  // namespace clerestory
