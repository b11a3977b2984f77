// Painted spheres: against their definition, gradients, rays that miss spheres, the seam and the poles.
#include "host/ops/light/shells.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/math/panorama.hpp"
#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

const std::vector<double> kRadii{0.5, 1, 3};

/// Where the ray leaves the sphere, by the roots in plain form; negative if it does not ahead.
double exit_of(const Vec3& p, const Vec3& d, double radius) {
  const double b = glm::dot(p, d), inside = b * b - glm::dot(p, p) + radius * radius;
  return inside <= 0 ? -1 : -b + std::sqrt(inside);
}

std::vector<Tensor> reference(const Tensors& t) {
  const Tensor &shells = t.at("shells"), &points = t.at("points"), &direction = t.at("direction");
  const Shape rays = points.shape, maps = shells.shape;
  const double scale = t.at("range").real[0];
  Tensor value(Shape{maps.n, 4, rays.h, rays.w}), met(Shape{maps.n, 1, rays.h, rays.w});
  for (int row = 0; row < rays.h; ++row)
    for (int s = 0; s < rays.w; ++s)
      for (int k = 0; k < maps.n; ++k) {
        const auto vector = [&](const Tensor& v) {
          return Vec3(v.at(0, 0, row, s), v.at(0, 1, row, s), v.at(0, 2, row, s));
        };
        const Vec3 p = vector(points) / scale, d = glm::normalize(vector(direction));
        const double along = exit_of(p, d, kRadii[static_cast<std::size_t>(k)]);
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

/// `reach`: how far rays start from the camera, in scales.
OpCase shells_case(const std::string& label, const Shape& rays, double reach, int rows, int columns) {
  OpCase c{.stem = "shells", .label = label, .kernels = {"look_up_shells", "shell_cells", "sum_shells"}};
  c.inputs = {{"shells", random_tensor({3, 4, rows, columns}, 1, 0, 2)},
              {"points", random_tensor(rays, 2, -2 * reach, 2 * reach)},
              {"direction", random_tensor(rays, 3)},
              {"range", Tensor({1, 3, 1, 1}, std::vector<double>{2, 1, 2})}};
  c.build = [=](Graph&, const Values& v) {
    const ShellSamples s = look_up_shells(v.at("shells"), v.at("points"), v.at("direction"), v.at("range"), kRadii);
    return std::vector{s.value, s.met};
  };
  c.reference = [](const Tensors& t) { return reference(t); };
  // A place on the map is off by a few units in the last place of the start's distance, times the columns.
  c.roundings = 64.0 * columns * (1 + reach), c.magnitude = 2;
  c.differentiate = {"shells"};
  c.step = 1e-2, c.gradient_tolerance = 1e-10;  // linear: a difference is exact but for rounding
  c.gradient_roundings = 64 * c.roundings;      // a texel sums the shares of many rays
  return c;
}

OP_CASES(shells) {
  return {shells_case("inside", {1, 3, 6, 32}, 0.2, 8, 16), shells_case("around", {1, 3, 6, 32}, 1.2, 5, 12),
          shells_case("outside", {1, 3, 4, 16}, 5, 2, 2)};
}

Tensor looked_up(const std::vector<Vec3>& directions, int rows, int columns) {
  Graph g;
  Tensor along(Shape{1, 3, 1, 16}, 1), map(Shape{1, 4, rows, columns});
  for (std::size_t s = 0; s < directions.size(); ++s)
    for (int c = 0; c < 3; ++c) along.at(0, c, 0, static_cast<int>(s)) = directions[s][c];
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) map.at(0, 0, y, x) = x, map.at(0, 1, y, x) = y;
  const ShellSamples s =
      look_up_shells(g.constant(map), g.fill(along.shape, 0), g.constant(along), g.fill({1, 3, 1, 1}, 1), {1.0});
  return evaluate(g, {s.value}, test_device(Precision::Double), {}, {.precision = Precision::Double})[0];
}

TEST(Shells, TexelCentresGiveTexels) {
  std::vector<Vec3> directions;
  for (int x = 0; x < 16; ++x) directions.push_back(3.0 * panorama_direction(x, 2, 16, 8));
  const Tensor found = looked_up(directions, 8, 16);
  for (int x = 0; x < 16; ++x) {
    EXPECT_NEAR(found.at(0, 0, 0, x), x, 1e-12);
    EXPECT_NEAR(found.at(0, 1, 0, x), 2, 1e-12);
  }
}

TEST(Shells, SeamIsCrossedAndPolesAreConstant) {
  // Straight backwards lies between the last and the first column; poles beyond the first and last row's centres.
  const Tensor found = looked_up({{0, 0, 1}, {0, 1, 0}, {0, -1, 0}, {-0.0, 2, 0.0}}, 8, 16);
  EXPECT_NEAR(found.at(0, 0, 0, 0), 7.5, 1e-12);  // the mean of 15 and 0
  EXPECT_NEAR(found.at(0, 1, 0, 1), 0, 1e-12);
  EXPECT_NEAR(found.at(0, 1, 0, 2), 7, 1e-12);
  EXPECT_NEAR(found.at(0, 0, 0, 3), found.at(0, 0, 0, 1), 1e-12);
}

TEST(Shells, WhatDoesNotFitIsRefused) {
  Graph g;
  const Value rays = g.input("rays", {1, 3, 2, 16}), range = g.input("range", {1, 3, 1, 1});
  EXPECT_THROW(look_up_shells(g.input("map", {2, 4, 4, 8}), rays, rays, range, {1.0}), Error);
  EXPECT_THROW(look_up_shells(g.input("three", {1, 3, 4, 8}), rays, rays, range, {1.0}), Error);
}

}  // namespace
}  // namespace clerestory
