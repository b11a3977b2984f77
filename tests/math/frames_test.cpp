// Frames on surfaces, the hemisphere raster and the panorama map: orthonormality, handedness, inverses, symmetry.
#include "host/math/frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <random>
#include <vector>

#include "host/math/panorama.hpp"

namespace clerestory {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

std::vector<Vec3> directions() {
  std::vector<Vec3> all;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x || y || z) all.push_back(glm::normalize(Vec3(x, y, z)));
  for (double small : {1e-3, 1e-9, 1e-16})  // beside the poles of both constructions
    for (double sign : {-1.0, 1.0}) {
      all.push_back(glm::normalize(Vec3(small, small, sign)));
      all.push_back(glm::normalize(Vec3(small, sign, -small)));
    }
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 500; ++i) all.push_back(glm::normalize(Vec3(normal(random), normal(random), normal(random))));
  return all;
}

void expect_orthonormal(const Frame& f, double tolerance) {
  EXPECT_NEAR(glm::length(f.x), 1, tolerance);
  EXPECT_NEAR(glm::length(f.y), 1, tolerance);
  EXPECT_NEAR(glm::dot(f.x, f.y), 0, tolerance);
  EXPECT_NEAR(glm::dot(f.x, f.z), 0, tolerance);
  EXPECT_NEAR(glm::dot(f.y, f.z), 0, tolerance);
}

TEST(Frames, AroundANormal) {
  for (const Vec3& n : directions()) {
    const Frame f = frame_around(n);
    EXPECT_EQ(f.z, n);
    expect_orthonormal(f, 16 * eps);
    EXPECT_NEAR(glm::length(glm::cross(f.x, f.y) - n), 0, 16 * eps) << "right-handed";
    const Vec3 v(0.3, -2, 0.7);
    EXPECT_NEAR(glm::length(f.from_local(f.to_local(v)) - v), 0, 32 * eps);
  }
}

TEST(Frames, HemisphereOfTheEnvironmentMaps) {
  for (const Vec3& n : directions()) {
    const Frame f = hemisphere_frame(n);
    // up - (up.n) n loses up to 1 / sin(angle) <= 1 / sqrt(1 - 0.999^2) < 23 of the digits before it is normalised.
    expect_orthonormal(f, 16 * 23 * eps);
    EXPECT_NEAR(glm::length(glm::cross(f.x, f.y) + n), 0, 16 * 23 * eps) << "left-handed, as released";
    const bool pole = std::abs(n.y) > 0.999;
    EXPECT_GT(pole ? f.y.z : f.y.y, 0) << "y leans towards up";
  }
  const Frame facing = hemisphere_frame({0, 0, 1});
  EXPECT_EQ(facing.x, Vec3(-1, 0, 0));
  EXPECT_EQ(facing.y, Vec3(0, 1, 0));
  const Frame floor = hemisphere_frame({0, 1, 0});
  EXPECT_EQ(floor.y, Vec3(0, 0, 1));
  EXPECT_EQ(floor.x, Vec3(1, 0, 0)) << "-(z cross y)";
}

// A room and its mirror image must have mirrored light: under x -> -x the raster's azimuth a becomes pi - a.
TEST(Frames, HemisphereIsMirrorSymmetric) {
  for (const Vec3& n : directions()) {
    const Frame f = hemisphere_frame(n), g = hemisphere_frame({-n.x, n.y, n.z});
    for (int row : {0, 3, 7})
      for (int column = 0; column < 16; ++column) {
        // Cells at azimuth -pi + (c + .5) pi/8: pi - a lies at column 7 - c, or 23 - c, modulo a turn.
        const int mirrored = (23 - column) % 16;
        const Vec3 a = f.from_local(hemisphere_direction(row, column));
        const Vec3 b = g.from_local(hemisphere_direction(row, mirrored));
        EXPECT_NEAR(glm::length(Vec3(-a.x, a.y, a.z) - b), 0, 64 * 23 * eps);
      }
  }
}

TEST(Frames, HemisphereRaster) {
  double solid_angle = 0, cosine = 0;
  for (int row = 0; row < 8; ++row)
    for (int column = 0; column < 16; ++column) {
      const Vec3 d = hemisphere_direction(row, column);
      EXPECT_NEAR(glm::length(d), 1, 4 * eps);
      EXPECT_GT(d.z, 0);
      solid_angle += hemisphere_weight(row);
      cosine += hemisphere_weight(row) * d.z;
    }
  // The midpoint rule in elevation, h = pi/16: relative error h^2/24 of the integral of sin, and h^2/6 of sin cos.
  const double h = glm::pi<double>() / 16;
  EXPECT_NEAR(solid_angle / glm::two_pi<double>(), 1 + h * h / 24, h * h * h * h);
  EXPECT_NEAR(cosine / glm::pi<double>(), 1 + h * h / 6, h * h * h * h);
  EXPECT_GT(hemisphere_direction(7, 8).x, 0.9) << "azimuth 0 is in the middle of the raster, along local x";
  EXPECT_GT(hemisphere_direction(0, 0).z, 0.9) << "the first row is the zenith";
}

TEST(Panorama, Axes) {
  EXPECT_EQ(panorama_position({0, 0, -1}), Vec2(0.5, 0.5));
  EXPECT_EQ(panorama_position({2, 0, 0}), Vec2(0.75, 0.5));
  EXPECT_EQ(panorama_position({-1, 0, 0}), Vec2(0.25, 0.5));
  EXPECT_EQ(panorama_position({0, 3, 0}), Vec2(0.5, 0));
  EXPECT_EQ(panorama_position({0, -1, 0}), Vec2(0.5, 1));
  const Vec2 behind = panorama_position({1e-12, 0, 1});
  EXPECT_NEAR(behind.x, 1 - 1e-12 / glm::two_pi<double>(), 2 * eps);
  EXPECT_GT(panorama_direction(256, 0, 512, 256).y, 0.99);
  EXPECT_LT(panorama_direction(256, 128, 512, 256).z, -0.99);
  EXPECT_GT(panorama_direction(384, 128, 512, 256).x, 0.99);
}

TEST(Panorama, BothWaysAgree) {
  for (const Vec3& d : directions())
    EXPECT_NEAR(glm::length(panorama_direction(panorama_position(d)) - d), 0, 16 * eps);
  for (int row : {0, 1, 100, 127})
    for (int column : {0, 5, 128, 255}) {
      const Vec2 uv = panorama_position(panorama_direction(column, row, 256, 128));
      // Near a pole the azimuth of a direction of length 1 is known to eps / sin(polar angle) only.
      const double sine = std::sin(glm::pi<double>() * (row + 0.5) / 128);
      EXPECT_NEAR(uv.x * 256, column + 0.5, 256 * 8 * eps / sine);
      EXPECT_NEAR(uv.y * 128, row + 0.5, 128 * 8 * eps);
    }
}

TEST(Panorama, MirrorsLeftAndRight) {
  for (const Vec3& d : directions()) {
    const Vec2 a = panorama_position(d), b = panorama_position({-d.x, d.y, d.z});
    if (std::abs(d.x) < 1e-12) continue;  // on the plane of symmetry, where the seam belongs to one side
    EXPECT_NEAR(a.x + b.x, 1, 4 * eps);
    EXPECT_EQ(a.y, b.y);
  }
}

TEST(Panorama, SolidAnglesSumToTheSphere) {
  for (int rows : {1, 8, 128}) {
    double total = 0;
    for (int row = 0; row < rows; ++row) total += panorama_solid_angle(row, 2 * rows, rows) * 2 * rows;
    EXPECT_NEAR(total, 4 * glm::pi<double>(), 4 * glm::pi<double>() * (rows + 8) * eps);
  }
}

}  // namespace
}  // namespace clerestory
