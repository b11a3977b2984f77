// Painted spheres by their definition, in double.
#pragma once
#include <algorithm>
#include <cmath>

#include "checks/op_case.hpp"
#include "host/math/panorama.hpp"

namespace clerestory {

inline const std::vector<double> kShellRadii{0.5, 1, 3};

/// Where the ray leaves the sphere, by the roots in plain form; negative if it does not ahead.
inline double exit_of(const Vec3& p, const Vec3& d, double radius) {
  const double b = glm::dot(p, d), inside = b * b - glm::dot(p, p) + radius * radius;
  return inside <= 0 ? -1 : -b + std::sqrt(inside);
}

/// Of `shells`, `points` (of each ray or of a row), `direction` and `range`: value and met as look_up_shells() gives
/// them.
inline std::vector<Tensor> looked_up_shells(const Tensors& t) {
  const Tensor &shells = t.at("shells"), &points = t.at("points"), &direction = t.at("direction");
  const Shape rays = direction.shape, maps = shells.shape;
  const double scale = t.at("range").real[0];
  Tensor value(Shape{maps.n, 4, rays.h, rays.w}), met(Shape{maps.n, 1, rays.h, rays.w});
  for (int row = 0; row < rays.h; ++row)
    for (int s = 0; s < rays.w; ++s)
      for (int k = 0; k < maps.n; ++k) {
        const auto vector = [&](const Tensor& v) {
          const int at = v.shape.w == 1 ? 0 : s;
          return Vec3(v.at(0, 0, row, at), v.at(0, 1, row, at), v.at(0, 2, row, at));
        };
        const Vec3 p = vector(points) / scale, to = vector(direction);
        const Vec3 d = to == Vec3(0) ? Vec3(0, 0, 1) : glm::normalize(to);
        const double along = exit_of(p, d, kShellRadii[static_cast<std::size_t>(k)]);
        met.at(k, 0, row, s) = along > 0 || k + 1 == maps.n;
        if (met.at(k, 0, row, s) == 0) continue;
        const Vec2 at = panorama_position(along > 0 ? p + along * d : d);
        const double x = at.x * maps.w - 0.5, y = std::clamp(at.y * maps.h - 0.5, 0.0, maps.h - 1.0);
        const int x0 = static_cast<int>(std::floor(x)), y0 = std::min(static_cast<int>(y), maps.h - 2);
        for (int c = 0; c < 4; ++c)
          for (int corner = 0; corner < 4; ++corner) {
            const int right = corner & 1, low = corner >> 1;
            const double share = (right ? x - x0 : 1 - (x - x0)) * (low ? y - y0 : 1 - (y - y0));
            value.at(k, c, row, s) += share * shells.at(k, c, y0 + low, (x0 + right + maps.w) % maps.w);
          }
      }
  return {value, met};
}

}  // namespace clerestory
