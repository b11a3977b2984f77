// Screen-space rays by brute force, in double: every cell of the picture against the ray. Written from the contract in
// camera space (a cell is a wedge of space between four planes through the eye), with nothing of the kernel's algebra.
#pragma once
#include <cmath>
#include <vector>

#include "host/graph/tensor.hpp"
#include "host/math/camera.hpp"

namespace clerestory {

struct BruteForce {
  Camera camera;
  const Tensor* depth = nullptr;   // {n, 1, h, w}
  const Tensor* normal = nullptr;  // {n, 3, h, w}, or null: cells that face away are hit too
  int item = 0;
  double thickness = 0;

  struct Hit {
    int pixel = -1;
    double delta = 0;             // metres
    double enters = 0, seen = 0;  // depths at which the ray enters the cell, and of the cell; metres
  };
  Hit trace(const Vec3& origin, const Vec3& direction, int skip) const {
    Hit hit;
    if (direction == Vec3(0)) return hit;
    const Shape& s = depth->shape;
    double first = INFINITY;
    for (int y = 0; y < s.h; ++y)
      for (int x = 0; x < s.w; ++x) {
        const double z = depth->at(item, 0, y, x);
        if (!(z > 0) || !std::isfinite(z)) continue;
        // t of the ray for which it lies in the wedge: m = -z, (cx m + fx X) >= x m and so on; each side is f + t g >=
        // 0.
        double t0 = 0, t1 = INFINITY;
        const auto clip = [&](double f, double g) {
          if (g > 0)
            t0 = std::max(t0, -f / g);
          else if (g < 0)
            t1 = std::min(t1, -f / g);
          else if (f < 0)
            t1 = -1;
        };
        const auto side = [&](const Vec3& plane) { clip(glm::dot(plane, origin), glm::dot(plane, direction)); };
        side({camera.fx, 0, x - camera.cx});
        side({-camera.fx, 0, camera.cx - (x + 1)});
        side({0, -camera.fy, y - camera.cy});
        side({0, camera.fy, camera.cy - (y + 1)});
        clip(-origin.z - 1e-6, -direction.z);
        if (!(t0 < t1)) continue;
        const double enters = -(origin.z + t0 * direction.z);
        const double leaves = std::isfinite(t1) ? -(origin.z + t1 * direction.z) : direction.z < 0 ? INFINITY : enters;
        const double deepest = std::max(enters, leaves), nearest = std::min(enters, leaves);
        if (deepest < z || t0 >= first || y * s.w + x == skip) continue;
        if (thickness > 0 && nearest > z + thickness) continue;
        if (normal) {
          const Vec3 n{normal->at(item, 0, y, x), normal->at(item, 1, y, x), normal->at(item, 2, y, x)};
          if (glm::dot(n, direction) > 0) continue;
        }
        first = t0;
        hit.pixel = y * s.w + x;
        hit.delta = std::max(0.0, enters - z);
        hit.enters = enters, hit.seen = z;
      }
    return hit;
  }
};

}  // namespace clerestory
