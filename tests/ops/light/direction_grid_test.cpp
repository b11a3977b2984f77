// Grids of directions and look-ups in them belong together: what a grid holds comes back along its own directions, and
// between them to second order.
#include "host/ops/light/direction_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "checks/op_case.hpp"
#include "host/graph/plan.hpp"

namespace clerestory {
namespace {

constexpr int kPixels = 12, kRays = 64;

/// A normal's directions, looked up in the grid that holds these directions themselves.
Tensor looked_up(const Tensor& normals, const Tensor& hit, const Tensor& direction, int side) {
  Graph graph;
  const Value normal = graph.constant(normals);
  const Value answers = grid_directions(normal, side).direction;
  const Value y = look_up_grid(answers, normal, graph.constant(hit), graph.constant(direction), {});
  return evaluate(graph, {y}, Device::open(), {})[0];
}

/// Rays that come down on each of the pixels, from over 0.2 rad above the horizon, unit.
Tensor rays_upon(const Tensor& normals) {
  Tensor direction = random_tensor({1, 3, kPixels, kRays}, 2);
  for (int p = 0; p < kPixels; ++p)
    for (int s = 0; s < kRays; ++s) {
      double along = 0, size = 0, length = 0;
      for (int c = 0; c < 3; ++c) along += direction.at(0, c, p, s) * normals.at(0, c, 0, p);
      for (int c = 0; c < 3; ++c) size += std::pow(normals.at(0, c, 0, p), 2);
      for (int c = 0; c < 3; ++c)  // mirrored to the side from which rays come, and lifted
        direction.at(0, c, p, s) -= (along + std::abs(along) + 0.3 * std::sqrt(size)) * normals.at(0, c, 0, p) / size;
      for (int c = 0; c < 3; ++c) length += std::pow(direction.at(0, c, p, s), 2);
      for (int c = 0; c < 3; ++c) direction.at(0, c, p, s) /= std::sqrt(length);
    }
  return direction;
}

Tensor own_pixels() {
  std::vector<int> hit;
  for (int i = 0; i < kPixels * kRays; ++i) hit.push_back(i / kRays);
  return Tensor::of_int({1, 1, kPixels, kRays}, std::move(hit));
}

double root_mean_square(const Tensor& a, const Tensor& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.real.size(); ++i) sum += std::pow(a.real[i] - b.real[i], 2);
  return std::sqrt(sum / static_cast<double>(a.real.size()));
}

TEST(DirectionGrid, HoldsWhatItWasAskedForAtItsPoints) {
  const Tensor normals = random_tensor({1, 3, 1, kPixels}, 1);
  Graph graph;
  const GridRays rays = grid_directions(graph.constant(normals), 8);
  const std::vector<Tensor> made = evaluate(graph, {rays.direction, rays.pixel}, Device::open(), {});
  const Tensor again = looked_up(normals, made[1], made[0], 8);
  // A place good to a few roundings among eight points, between directions less than one apart.
  for (std::size_t i = 0; i < again.real.size(); ++i)
    ASSERT_NEAR(again.real[i], made[0].real[i], 8 * 20 * 0x1p-24) << i;
}

TEST(DirectionGrid, IsOfSecondOrderBetweenThem) {
  const Tensor normals = random_tensor({1, 3, 1, kPixels}, 1), direction = rays_upon(normals), hit = own_pixels();
  const double coarse = root_mean_square(looked_up(normals, hit, direction, 8), direction),
               fine = root_mean_square(looked_up(normals, hit, direction, 16), direction);
  // Spacings are as 2 to 1, errors as their squares. Creases of the map, where its slope jumps, cost some of it.
  EXPECT_GT(coarse, 3 * fine);
  EXPECT_LT(coarse, 0.5 * std::pow(2.0 / 8, 2)) << "half the square of the spacing, times a second derivative of one";
  EXPECT_GT(fine, 0);
}

TEST(DirectionGrid, WhatDoesNotFitIsRefused) {
  Graph graph;
  const Value normal = graph.input("normal", {1, 3, 2, 3}), direction = graph.input("direction", {1, 3, 4, 16});
  const Value hit = graph.input("hit", {1, 1, 4, 16}, Type::Int);
  EXPECT_THROW(grid_directions(normal, 6), Error);
  EXPECT_THROW(grid_directions(graph.input("two", {2, 3, 2, 3}), 4), Error);
  EXPECT_THROW(look_up_grid(graph.input("other picture", {1, 3, 5, 16}), normal, hit, direction, {}), Error);
  EXPECT_THROW(look_up_grid(graph.input("no square", {1, 3, 6, 12}), normal, hit, direction, {}), Error);
  EXPECT_THROW(
      look_up_grid(graph.input("grid", {1, 3, 6, 16}), normal, graph.input("reals", {1, 1, 4, 16}), direction, {}),
      Error);
}

}  // namespace
}  // namespace clerestory
