// Small scenes and rays through the screen, and how far behind what they hit brute force finds them.
#pragma once
#include <cmath>
#include <random>

#include "checks/light/brute_force.hpp"
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

struct Rays {
  Tensor directions, points, skip;  // points and skip empty: from the pixels' own surfaces
  bool of_pixels = false;
};

/// Origins anywhere: in the room, behind the camera, outside of the frustum, behind the surfaces.
inline Rays rays_from_anywhere(int rows, unsigned seed, int pixels) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Rays rays{directions(rows, seed + 1), Tensor(Shape{1, 3, rows, 16}), {}};
  std::vector<int> skip;
  for (int p = 0; p < rows; ++p)
    for (int k = 0; k < 16; ++k) {
      const Vec3 o{4 * unit(random), 4 * unit(random), -2.5 + 4 * unit(random)};
      for (int c = 0; c < 3; ++c) rays.points.at(0, c, p, k) = static_cast<float>(o[c]);
      skip.push_back(k % 2 ? -1 : static_cast<int>(random() % static_cast<unsigned>(pixels)));
    }
  rays.skip = Tensor::of_int({1, 1, rows, 16}, skip);
  return rays;
}

/// How far behind the surface it hits a ray is, as `delta` counts it. Window depth is what a projection to n = the
/// nearest and f = the farthest depth of the picture leaves in the depth buffer: (1/n - 1/z) / (1/n - 1/f). `range` by
/// depth_range().
inline double gap_of(const BruteForce::Hit& hit, const Tensor& range, int item, DeltaDepth delta) {
  if (hit.pixel < 0) return 0;
  if (delta == DeltaDepth::Linear) return hit.delta / range.at(item, 0, 0, 0);
  const double n = range.at(item, 1, 0, 0), f = range.at(item, 2, 0, 0);
  const auto window = [&](double z) { return (1 / n - 1 / z) / (1 / n - 1 / f); };
  return std::max(0.0, window(hit.enters) - window(hit.seen));
}

}  // namespace clerestory::ssrt_scenes
