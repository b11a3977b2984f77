// Painted spheres: centres of texels, the seam and the poles, what is refused.
#include "host/ops/light/shells.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/math/panorama.hpp"
#include "tests/ops/test_device.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

// Places among up to sixteen texels, a few roundings of a sixteenth of a turn each.
constexpr double kOfPlace = 16 * 16 * kDoubleRounding;

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
    EXPECT_NEAR(found.at(0, 0, 0, x), x, kOfPlace);
    EXPECT_NEAR(found.at(0, 1, 0, x), 2, kOfPlace);
  }
}

TEST(Shells, SeamIsCrossedAndPolesAreConstant) {
  // Straight backwards lies between the last and the first column; poles beyond the first and last row's centres.
  const Tensor found = looked_up({{0, 0, 1}, {0, 1, 0}, {0, -1, 0}, {-0.0, 2, 0.0}}, 8, 16);
  EXPECT_NEAR(found.at(0, 0, 0, 0), 7.5, kOfPlace);  // the mean of 15 and 0
  EXPECT_NEAR(found.at(0, 1, 0, 1), 0, kOfPlace);
  EXPECT_NEAR(found.at(0, 1, 0, 2), 7, kOfPlace);
  EXPECT_NEAR(found.at(0, 0, 0, 3), found.at(0, 0, 0, 1), kOfPlace);
}

// Its column would lie gigabytes before the map.
TEST(Shells, ADirectionThatIsNoNumberReadsNothingElse) {
  const Tensor found = looked_up({{NAN, 0, -1}, {0, 1, 0}}, 8, 16);
  EXPECT_NEAR(found.at(0, 1, 0, 1), 0, kOfPlace);
}

TEST(Shells, WhatDoesNotFitIsRefused) {
  Graph g;
  const Value rays = g.input("rays", {1, 3, 2, 16}), range = g.input("range", {1, 3, 1, 1});
  EXPECT_THROW(look_up_shells(g.input("map", {2, 4, 4, 8}), rays, rays, range, {1.0}), Error);
  EXPECT_THROW(look_up_shells(g.input("three", {1, 3, 4, 8}), rays, rays, range, {1.0}), Error);
}

}  // namespace
}  // namespace clerestory
