// Points along rays: stratification, short ways, chunks.
#include "host/ops/light/march.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "checks/op_case.hpp"
#include "tests/ops/test_device.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

TEST(March, JitterIsStratifiedAndEven) {
  constexpr int rows = 64, samples = 64, segments = 7;
  constexpr Shape rays{1, 3, rows, samples};
  Graph g;
  Tensor direction(rays);
  for (int row = 0; row < rows; ++row)
    for (int s = 0; s < samples; ++s) direction.at(0, 2, row, s) = -1;
  const Value points = g.constant(Tensor(rays)), along = g.constant(direction),
              range = g.constant(Tensor(Shape{1, 3, 1, 1}, 1));
  const Marched m = march(points, along, range, {1, 1, rows, samples}, {.segments = segments, .near = 0, .radius = 7});
  const auto run = [&](std::uint32_t seed) {
    Executor executor(
        compile(g, {m.position, m.length}, test_device(Precision::Double), {.precision = Precision::Double}));
    executor.run(seed);
    return std::vector{executor.fetch(m.position), executor.fetch(m.length)};
  };
  const std::vector<Tensor> first = run(1), second = run(2);
  double mean[segments] = {}, correlation = 0;
  for (int row = 0; row < rows; ++row)
    for (int s = 0; s < samples; ++s) {
      double covered = -first[0].at(0, 2, row, s), last = 0;
      for (int k = 0; k < segments; ++k) {
        const double t = -first[0].at(k, 2, row, s) - k;  // pieces have the length 1
        ASSERT_GE(t, 0);
        ASSERT_LT(t, 1);
        if (k > 0) correlation += (t - 0.5) * (last - 0.5) / (rows * samples * (segments - 1));
        last = t, mean[k] += t / (rows * samples), covered += first[1].at(k, 0, row, s);
      }
      EXPECT_NEAR(covered, 7, 2 * segments * 7 * kDoubleRounding);
    }
  // A uniform number has the variance 1/12; 4 standard errors of the mean, and of products of variance 1/144.
  for (const double x : mean) EXPECT_NEAR(x, 0.5, 4 * std::sqrt(1.0 / 12 / (rows * samples)));
  EXPECT_NEAR(correlation, 0, 4.0 / 12 / std::sqrt(rows * samples * (segments - 1)));
  EXPECT_NE(first[0].real, second[0].real);
  EXPECT_EQ(first[0].real, run(1)[0].real);
}

// Just below the sphere a ray that goes outward has a short way to go, and that keeps its digits: the exit is not the
// difference of two lengths of the size of the sphere.
TEST(March, AShortWayOutKeepsItsDigits) {
  constexpr Shape rays{1, 3, 1, 16};
  Tensor points(rays), direction(rays);
  for (int s = 0; s < 16; ++s) {
    points.at(0, 2, 0, s) = static_cast<float>(-3 + std::ldexp(1.0, -s) / 7);  // on the axis: its distance is exact
    direction.at(0, 0, 0, s) = 3, direction.at(0, 2, 0, s) = -4;
  }
  Graph g;
  const Marched m = march(g.constant(points), g.constant(direction), g.constant(Tensor(Shape{1, 3, 1, 1}, 1)),
                          {1, 1, 1, 1}, {.segments = 1, .near = 0, .radius = 3, .jitter = false});
  const Tensor length = evaluate(g, {m.length}, test_device(), {})[0];
  for (int s = 0; s < 16; ++s) {
    const double z = -points.at(0, 2, 0, s), b = 0.8 * z, c = (z - 3) * (z + 3);
    const double want = -c / (b + std::sqrt(b * b - c)) / 2;  // from the middle of the one piece
    // Some ten roundings: the unit direction, b, c, the root, the quotient, the middle.
    EXPECT_NEAR(length.at(0, 0, 0, s), want, 10 * 0x1p-23 * want) << s;
  }
}

// A chunk of samples and pixels is a part of the whole: its rays are jittered as they are there.
TEST(March, JitterIsThatOfTheRayInAnyChunk) {
  constexpr Shape all{1, 3, 8, 48}, tile{1, 3, 4, 16};
  const MarchOptions options{.segments = 6, .near = 0.05, .radius = 3};
  const Tensor points = random_tensor(all, 1), direction = random_tensor(all, 2);
  const auto part_of = [&](const Tensor& whole) {
    Tensor part(tile);
    for (int c = 0; c < 3; ++c)
      for (int p = 0; p < 4; ++p)
        for (int s = 0; s < 16; ++s) part.at(0, c, p, s) = whole.at(0, c, p + 3, s + 32);
    return part;
  };
  const auto run = [&](const Tensor& from, const Tensor& along, const Chunk& chunk) {
    Graph g;
    const Value range = g.constant(Tensor(Shape{1, 3, 1, 1}, 2));
    const Marched m = march(g.constant(from), g.constant(along), range, {1, 1, 8, 8}, options);
    Executor executor(compile(g, {m.position, m.length}, test_device()));
    executor.run(11, chunk);
    return std::vector{executor.fetch(m.position), executor.fetch(m.length)};
  };
  const std::vector<Tensor> whole = run(points, direction, {0, 8, 0, 48}),
                            part = run(part_of(points), part_of(direction), {3, 4, 32, 16});
  for (std::size_t o = 0; o < 2; ++o)
    for (int k = 0; k < 6; ++k)
      for (int c = 0; c < part[o].shape.c; ++c)
        for (int p = 0; p < 4; ++p)
          for (int s = 0; s < 16; ++s) ASSERT_EQ(part[o].at(k, c, p, s), whole[o].at(k, c, p + 3, s + 32));
}

}  // namespace
}  // namespace clerestory
