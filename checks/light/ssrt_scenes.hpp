// Small scenes and directions for rays through the screen.
#pragma once
#include <cmath>
#include <random>

#include "host/ops/light/ssrt.hpp"

namespace clerestory::ssrt_scenes {

inline Camera small_camera(int w, int h) {
  Camera c = Camera::from_fov(w, h, 70.0);
  c.fy *= 1.1, c.cx += 0.31, c.cy -= 0.17;  // nothing square or centred, no pixel on a diagonal to the centre
  return c;
}

/// A rough landscape of depths between 1 and 4 metres with a step and holes.
inline Tensor landscape(int n, int h, int w, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  Tensor depth(Shape{n, 1, h, w});
  for (int k = 0; k < n; ++k)
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        double z = 2.5 + std::sin(0.9 * x + k) * std::cos(0.6 * y) + 0.3 * unit(random) - (x > w / 2 ? 0.6 : 0.0);
        if (unit(random) < 0.05) z = 0;
        depth.at(k, 0, y, x) = static_cast<float>(z);
      }
  return depth;
}

inline Tensor random_normals(int n, int h, int w, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Tensor map(Shape{n, 3, h, w});
  for (int k = 0; k < n; ++k)
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        const Vec3 v = glm::normalize(Vec3(normal(random), normal(random), 0.3 + std::abs(normal(random))));
        for (int c = 0; c < 3; ++c) map.at(k, c, y, x) = static_cast<float>(v[c]);
      }
  return map;
}

/// Directions for `rows` x 16 rays: random, with some along axes, towards and away from the camera, and none.
inline Tensor directions(int rows, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Tensor d(Shape{1, 3, rows, 16});
  for (int p = 0; p < rows; ++p)
    for (int s = 0; s < 16; ++s) {
      Vec3 v = glm::normalize(Vec3(normal(random), normal(random), normal(random)));
      if (s < 6) v = Vec3(0), v[s / 2] = s % 2 ? 1 : -1;
      if (s == 6) v.x = 0;
      if (s == 7) v.y = 0;
      if (s == 8) v.z = 0;
      if (s == 9) v = Vec3(0);
      for (int c = 0; c < 3; ++c) d.at(0, c, p, s) = static_cast<float>(v[c]);
    }
  return d;
}

struct Scene {
  Camera camera;
  Tensor depth, normal;
  Tensor cameras() const { return camera_tensor(std::vector<Camera>(static_cast<std::size_t>(depth.shape.n), camera)); }
};

inline Scene scene_of(int n, int h, int w, unsigned seed) {
  return {small_camera(w, h), landscape(n, h, w, seed), random_normals(n, h, w, seed + 1)};
}

}  // namespace clerestory::ssrt_scenes
