// Cameras: the field of view, resizing, and the conventions of the image plane.
#include "host/math/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

void expect_usage_error(const std::function<void()>& call, const std::string& part) {
  try {
    call();
    FAIL() << "no error; expected one that says " << part;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Usage);
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(Camera, HorizontalFieldOfView) {
  const Camera camera = Camera::from_fov(640, 480, 85);
  // 320 / tan(42.5 degrees), the value stated for InteriorVerse at width 640.
  EXPECT_NEAR(camera.fx, 349.2, 0.05);
  EXPECT_EQ(camera.fx, camera.fy);
  EXPECT_EQ(camera.cx, 320);
  EXPECT_EQ(camera.cy, 240);
  EXPECT_NEAR(camera.fov_degrees(), 85, 85 * 8 * eps);
}

TEST(Camera, DefaultSpansTheLongerSide) {
  const Camera wide = Camera::from_fov(640, 480), tall = Camera::from_fov(480, 640);
  EXPECT_NEAR(wide.fov_degrees(), 65, 65 * 8 * eps);
  EXPECT_EQ(wide.fx, tall.fx);
  EXPECT_LT(tall.fov_degrees(), 65);
}

TEST(Camera, RefusesBadFieldsOfView) {
  for (double fov : {0.0, -10.0, 180.0, 500.0, std::nan(""), HUGE_VAL})
    expect_usage_error([&] { Camera::from_fov(640, 480, fov); }, "--fov");
  for (auto [w, h] : {std::pair{0, 480}, {640, 0}, {-1, 10}})
    expect_usage_error([&] { Camera::from_fov(w, h, 60); }, fmt::format("{}x{}", w, h));
}

TEST(Camera, RefusesWrongFields) {
  const Camera good = Camera::from_fov(64, 48, 60);
  EXPECT_NO_THROW(good.check("c"));
  auto with = [&](auto change) {
    Camera camera = good;
    change(camera);
    return [camera] { camera.check("cam.json"); };
  };
  expect_usage_error(with([](Camera& c) { c.fx = 0; }), "fx");
  expect_usage_error(with([](Camera& c) { c.fy = std::nan(""); }), "fy");
  expect_usage_error(with([](Camera& c) { c.fy = HUGE_VAL; }), "fy");
  expect_usage_error(with([](Camera& c) { c.cx = HUGE_VAL; }), "cx");
  expect_usage_error(with([](Camera& c) { c.width = 0; }), "cam.json");
  expect_usage_error(with([](Camera& c) { c.camera_to_world[3] = std::nan(""); }), "not finite");
  expect_usage_error(with([](Camera& c) { c.camera_to_world[0] = 2; }), "orthonormal");
  expect_usage_error(with([](Camera& c) { c.camera_to_world[0] = -1; }), "mirrors");
  expect_usage_error(with([](Camera& c) { c.camera_to_world[12] = 1; }), "row-major");
  expect_usage_error([&] { (void)good.resized(0, 3); }, "0x3");
}

TEST(Camera, AxesOfTheImage) {
  const Camera camera = Camera::from_fov(101, 51, 60);
  const Vec3 middle = camera.direction(50.5, 25.5);
  EXPECT_EQ(middle, Vec3(0, 0, -1));
  EXPECT_GT(camera.ray(60, 25.5).x, 0) << "x grows to the right";
  EXPECT_GT(camera.ray(50.5, 10).y, 0) << "rows grow downwards, y upwards";
  EXPECT_EQ(camera.unproject(60, 10, 2.5).z, -2.5) << "depth is axial";
}

TEST(Camera, UnprojectAndProjectAreInverse) {
  Camera camera = Camera::from_fov(640, 480, 85);
  camera.fy *= 1.1, camera.cx += 7.25, camera.cy -= 3.5;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 1000; ++i) {
    const double x = 1000 * uniform(random) - 100, y = 1000 * uniform(random) - 100, depth = 0.1 + 10 * uniform(random);
    const auto position = camera.project(camera.unproject(x, y, depth));
    ASSERT_TRUE(position.has_value());
    // A handful of roundings of numbers up to about 1000.
    EXPECT_NEAR(position->x, x, 8 * eps * 1000);
    EXPECT_NEAR(position->y, y, 8 * eps * 1000);
  }
  EXPECT_FALSE(camera.project({0, 0, 0}).has_value());
  EXPECT_FALSE(camera.project({0, 0, 1}).has_value());
}

TEST(Camera, ResizingKeepsTheRays) {
  Camera camera = Camera::from_fov(640, 480, 70);
  camera.fy *= 1.07, camera.cx = 311.7, camera.cy = 255.4;
  const Camera small = camera.resized(200, 111);
  EXPECT_EQ(small.width, 200);
  EXPECT_EQ(small.height, 111);
  for (double u : {0.0, 0.25, 0.7, 1.0})
    for (double v : {0.0, 0.4, 1.0}) {
      const Vec3 before = camera.ray(u * 640, v * 480), after = small.ray(u * 200, v * 111);
      EXPECT_NEAR(glm::length(before - after), 0, 16 * eps);
    }
  EXPECT_NEAR(small.fov_degrees(), camera.fov_degrees(), 70 * 16 * eps);
}

TEST(Camera, LooksAt) {
  Camera camera = Camera::from_fov(64, 48, 60);
  look_at(camera, {1, 2, 3}, {1, 2, -5});
  EXPECT_EQ(camera.camera_to_world, (std::array<double, 16>{1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1}));

  const Vec3 eye(0.3, 1.5, -2), target(3, 0.2, 1);
  look_at(camera, eye, target);
  EXPECT_NO_THROW(camera.check("look_at"));
  const Vec3 seen = camera.to_camera(target);
  EXPECT_NEAR(seen.x, 0, 16 * eps);
  EXPECT_NEAR(seen.y, 0, 16 * eps);
  EXPECT_NEAR(-seen.z, glm::length(target - eye), 16 * eps * 5);
  EXPECT_EQ(camera.direction_to_world({1, 0, 0}).y, 0) << "the horizon is level";
  EXPECT_GT(camera.direction_to_world({0, 1, 0}).y, 0) << "upright";
  const Vec3 point(-0.4, 2, 7);
  EXPECT_NEAR(glm::length(camera.to_world(camera.to_camera(point)) - point), 0, 32 * eps * 8);
  EXPECT_NEAR(glm::length(camera.direction_to_camera(camera.direction_to_world(point)) - point), 0, 32 * eps * 8);

  expect_usage_error([&] { look_at(camera, eye, eye); }, "vertical");
  expect_usage_error([&] { look_at(camera, eye, eye + Vec3(0, 1, 0)); }, "vertical");
}

TEST(Camera, CoarseGridSeesTheSamePoints) {
  const Camera camera = Camera::from_fov(40, 30, 70), coarse = every_nth(camera, 5, 3, 1);
  EXPECT_EQ(coarse.width, 8);
  EXPECT_EQ(coarse.height, 6);
  for (const int i : {0, 3, 7}) {
    const Vec3 a = coarse.ray(i + 0.5, i % 6 + 0.5), b = camera.ray(5 * i + 3.5, 5 * (i % 6) + 1.5);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 8 * eps);
  }
}

}  // namespace
}  // namespace clerestory
