// Painted spheres: against their definition, gradients, rays that miss spheres, the seam and the poles.
#include "host/ops/light/shells.hpp"

#include <gtest/gtest.h>

#include "tests/ops/light/shell_reference.hpp"

namespace clerestory {
namespace {

/// `reach`: how far rays start from the camera, in scales.
OpCase shells_case(const std::string& label, const Shape& rays, double reach, int rows, int columns) {
  OpCase c{.stem = "shells", .label = label, .kernels = {"look_up_shells", "shell_cells", "sum_shells"}};
  c.inputs = {{"shells", random_tensor({3, 4, rows, columns}, 1, 0, 2)},
              {"points", random_tensor(rays, 2, -2 * reach, 2 * reach)},
              {"direction", random_tensor(rays, 3)},
              {"range", Tensor({1, 3, 1, 1}, std::vector<double>{2, 1, 2})}};
  c.build = [=](Graph&, const Values& v) {
    const ShellSamples s =
        look_up_shells(v.at("shells"), v.at("points"), v.at("direction"), v.at("range"), kShellRadii);
    return std::vector{s.value, s.met};
  };
  c.reference = [](const Tensors& t) { return looked_up_shells(t); };
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
