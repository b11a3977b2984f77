// What is finer than a pixel is averaged over it: maps of few pixels against the block means of maps of many.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/tracer/scenes.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = 40, kHeight = 30, kTimes = 16;

/// A wall two metres before the camera, texture coordinates along x and y in metres.
World wall(const Material& material) {
  World world;
  world.materials = {material};
  const glm::vec3 corners[4] = {{-4, -3, -2}, {4, -3, -2}, {4, 3, -2}, {-4, 3, -2}};
  for (const auto& [b, c] : {std::pair{1, 2}, std::pair{2, 3}}) {
    Triangle t;
    const int of[3] = {0, b, c};
    for (int k = 0; k < 3; ++k) t.v[k] = {corners[of[k]], corners[of[k]], {0, 0, 1}};
    world.triangles.push_back(t);
  }
  return world;
}

Material tiles(float size, float gap) {
  Material m = plain(glm::vec3(0.4f), 0.1f);
  m.texture = static_cast<float>(Texture::Tiles);
  m.roughness_c = 0.9f;
  m.scale = {1 / size, 2 / size, 1};
  m.gap = gap;
  return m;
}

struct Compared {
  double farthest = 0, mean = 0, fine_mean = 0, spread = 0;
};

/// Roughness of pixels against the means of the kTimes^2 pixels that divide each; spread: of the coarse pixels.
Compared compare(const Material& material) {
  TraceScene scene(test_device(), wall(material));
  const double fov = 24;  // pixels at the edge see the wall within 3 % of its front
  const Image coarse = scene.maps(Camera::from_fov(kWidth, kHeight, fov)).roughness;
  const Image fine = scene.maps(Camera::from_fov(kWidth * kTimes, kHeight * kTimes, fov)).roughness;
  Compared out;
  double squares = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double block = 0;
      for (int k = 0; k < kTimes * kTimes; ++k)
        block += static_cast<double>(fine.at(0, y * kTimes + k / kTimes, x * kTimes + k % kTimes));
      block /= kTimes * kTimes;
      const double value = static_cast<double>(coarse.at(0, y, x));
      out.farthest = std::max(out.farthest, std::abs(value - block));
      out.mean += value, out.fine_mean += block, squares += value * value;
    }
  }
  constexpr int pixels = kWidth * kHeight;
  out.mean /= pixels, out.fine_mean /= pixels;
  out.spread = std::sqrt(std::max(0.0, squares / pixels - out.mean * out.mean));
  return out;
}

TEST(Texture, AJointIsSeenByItsShareOfThePixel) {
  // The box over a pixel is exact along each axis and 3 % too wide at the picture's edge.
  for (const auto& [size, gap] : {std::pair{0.6f, 0.01f}, {0.2f, 0.02f}, {0.05f, 0.03f}, {0.01f, 0.2f}}) {
    const Compared c = compare(tiles(size, gap));
    EXPECT_LT(c.farthest, 0.03 * 0.8) << size;
    EXPECT_NEAR(c.mean, c.fine_mean, 0.002) << size;
    // Half of `gap` lies on either side of an edge across u; across v the same metres are twice that share.
    const double open = (1 - 2 * static_cast<double>(gap)) * (1 - 4 * static_cast<double>(gap));
    EXPECT_NEAR(c.fine_mean, 0.9 - 0.8 * open, 0.02) << size;
  }
}

TEST(Texture, JointsBelowThePixelBlurToAConstant) {
  EXPECT_LT(compare(tiles(0.002f, 0.2f)).spread, 0.02);
  EXPECT_GT(compare(tiles(0.2f, 0.05f)).spread, 0.05);
}

TEST(Texture, GrainBelowThePixelBlursToItsMean) {
  Material leather = plain(glm::vec3(0.4f), 0.3f);
  leather.texture = static_cast<float>(Texture::Leather);
  leather.roughness_a = 0.8f;
  leather.scale = glm::vec3(2000.f);
  const Compared c = compare(leather);
  EXPECT_LT(c.spread, 1e-3);
  leather.scale = glm::vec3(3.f);
  EXPECT_GT(compare(leather).spread, 0.05);
  // The mean that blurred leather takes is that of leather near by.
  EXPECT_NEAR(compare(leather).fine_mean, c.mean, 0.05);
}

}  // namespace
}  // namespace clerestory
