// Objects that stand `at` a pixel touch the surface that rays meet, whatever the map of normals says.
#include "experiments/applications/surface_plane.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "experiments/applications/insert.hpp"

namespace clerestory {
namespace {

/// The plane n . X = d before a camera of 64x48 pixels, under a map of normals that says otherwise.
struct SurfacePlane : testing::Test {
  Scene plane(const Vec3& n, double d) {
    Scene scene;
    scene.camera = Camera::from_fov(64, 48, 60);
    scene.photo = scene.albedo = scene.normal = Image(64, 48, 3);
    scene.material = Image(64, 48, 3), scene.depth = Image(64, 48, 1);
    std::ranges::fill(scene.photo.data, 0.5f), std::ranges::fill(scene.albedo.data, 0.5f);
    std::fill_n(scene.normal.plane(2), scene.normal.pixels(), 1.0f);
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x) {
        const double z = d / glm::dot(n, scene.camera.ray(x + 0.5, y + 0.5));
        scene.depth.at(0, y, x) = z > 0 && z < 100 ? static_cast<float>(z) : 0;
      }
    return scene;
  }
  static Vec3 floor_normal() {
    const double tilt = 20 * std::numbers::pi / 180;
    return {0, std::cos(tilt), std::sin(tilt)};
  }
};

// Depths are floats: over a reach of three pixels of a hundred degrees of view the normal is known to 1e-4.
TEST_F(SurfacePlane, IsThatOfTheDepths) {
  for (const Vec3& n : {floor_normal(), glm::normalize(Vec3(0.3, 0.2, 0.9)), glm::normalize(Vec3(-0.9, 0.1, 0.3))}) {
    const Scene scene = plane(n, glm::dot(n, Vec3(0.2, -1, -3)));
    const auto found = plane_normal_at(scene, 33, 36);
    ASSERT_TRUE(found);
    EXPECT_NEAR(glm::length(*found - (glm::dot(n, scene.camera.ray(33.5, 36.5)) < 0 ? n : -n)), 0, 1e-4);
  }
}

TEST_F(SurfacePlane, OtherSurfacesBesideItHaveLittleSay) {
  Scene scene = plane(floor_normal(), -1);
  for (int y = 0; y < 48; ++y)
    for (int x = 35; x < 64; ++x) scene.depth.at(0, y, x) *= 0.5f;  // a table ends two pixels away
  const auto found = plane_normal_at(scene, 33, 40);
  ASSERT_TRUE(found);
  EXPECT_GT(glm::dot(*found, floor_normal()), std::cos(1 * std::numbers::pi / 180));
}

TEST_F(SurfacePlane, IsNotMadeUpOfFewDepths) {
  Scene scene = plane(floor_normal(), -1);
  std::ranges::fill(scene.depth.data, 0.0f);
  EXPECT_FALSE(plane_normal_at(scene, 33, 40));
  for (int x = 30; x < 37; ++x) scene.depth.at(0, 40, x) = 2;
  EXPECT_FALSE(plane_normal_at(scene, 33, 40));
  scene.depth.at(0, 40, 33) = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(plane_normal_at(scene, 33, 40));
}

TEST_F(SurfacePlane, BallsTouchItAlongTheNormalOfTheMap) {
  const Vec3 n = floor_normal();
  Scene scene = plane(n, -1);
  InsertedObject ball;
  ball.at = {{33, 40}}, ball.radius = 0.2;
  const Vec3 foot = surface_at(scene, *ball.at).first;
  for (const double tilt : {20.0, 50.0, -25.0}) {  // degrees; the plane's is 20
    const Vec3 map(0, std::cos(tilt * std::numbers::pi / 180), std::sin(tilt * std::numbers::pi / 180));
    for (int c = 0; c < 3; ++c) std::fill_n(scene.normal.plane(c), scene.normal.pixels(), static_cast<float>(map[c]));
    double lowest = 1, highest = -1;
    Vec3 centre(0);
    const Mesh mesh = place_objects(scene, {ball})[0].mesh;
    for (const auto& p : mesh.positions) {
      const double above = glm::dot(n, Vec3(p[0], p[1], p[2])) + 1;
      lowest = std::min(lowest, above), highest = std::max(highest, above);
      centre += Vec3(p[0], p[1], p[2]) / static_cast<double>(mesh.positions.size());
    }
    EXPECT_NEAR(lowest, 0, 0.005 * 0.2) << "facets stand off the ball by 2e-3 of its radius";
    EXPECT_NEAR(highest, 0.4, 0.005 * 0.2);
    EXPECT_GT(glm::dot(glm::normalize(centre - foot), map), 0.999);
  }
}

}  // namespace
}  // namespace clerestory
