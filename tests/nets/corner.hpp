// A scene for tests of lights: small, with every kind of surface that they tell apart.
#pragma once
#include <algorithm>
#include <cmath>

#include "nets/scene.hpp"

namespace clerestory {

inline constexpr int kCornerWidth = 40, kCornerHeight = 28;

/// A number in (0, 1) that looks random.
inline double noise(int i, int salt) {
  const double x = std::sin(12.9898 * i + 78.233 * salt) * 43758.5453;
  return x - std::floor(x);
}

/// A corner of a room: a wall ahead, one at the left, a floor; a bright window; boxes of noise as materials.
inline Scene corner() {
  Scene s;
  s.camera = Camera::from_fov(kCornerWidth, kCornerHeight, 70);
  const auto map = [](int channels) { return Image(kCornerWidth, kCornerHeight, channels); };
  s.photo = map(3), s.albedo = map(3), s.normal = map(3), s.depth = map(1), s.material = map(3);
  for (int y = 0; y < kCornerHeight; ++y)
    for (int x = 0; x < kCornerWidth; ++x) {
      const Vec3 ray = s.camera.ray(x + 0.5, y + 0.5);
      const double wall = 4, left = ray.x < 0 ? -1.5 / ray.x : 1e9, floor = ray.y < 0 ? -1.2 / ray.y : 1e9;
      const double depth = std::min({wall, left, floor});
      s.depth.at(0, y, x) = static_cast<float>(depth);
      const Vec3 n = depth == wall ? Vec3(0, 0, 1) : depth == left ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
      const int i = y * kCornerWidth + x;
      for (int c = 0; c < 3; ++c) {
        s.normal.at(c, y, x) = static_cast<float>(n[c]);
        s.albedo.at(c, y, x) = static_cast<float>(0.2 + 0.6 * noise(i, c));
        s.photo.at(c, y, x) = static_cast<float>((x > 25 && x < 32 && y < 10 ? 9 : 0.3) * (0.5 + noise(i, 5 + c)));
      }
      s.material.at(0, y, x) = static_cast<float>(0.1 + 0.8 * noise(i / 3, 9));
      s.material.at(1, y, x) = i % 5 == 0 ? 1.0f : 0.0f;
    }
  return s;
}

}  // namespace clerestory
