// Points along rays: against the sphere's definition, stratification, rays from outside.
#include "host/ops/light/march.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

constexpr Shape kRays{1, 3, 6, 16}, kPicture{2, 1, 1, 3};  // rows 0 to 2 are of the first picture
constexpr double kNear = 0.05, kRadius = 3;

/// Where the ray leaves the sphere, by bisection between its point nearest the centre and far away.
double exit_of(const double p[3], const double d[3]) {
  double nearest = 0;
  for (int c = 0; c < 3; ++c) nearest -= p[c] * d[c];
  const auto distance = [&](double t) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += (p[c] + t * d[c]) * (p[c] + t * d[c]);
    return std::sqrt(sum);
  };
  double low = std::max(nearest, 0.0), high = 1e4;
  if (distance(low) >= kRadius) return kNear;
  for (int i = 0; i < 200; ++i) {
    const double middle = (low + high) / 2;
    (distance(middle) < kRadius ? low : high) = middle;
  }
  return std::max(low, kNear);
}

std::vector<Tensor> reference(const Tensors& t, int segments) {
  Tensor position(Shape{segments, 3, kRays.h, kRays.w}), length(Shape{segments, 1, kRays.h, kRays.w});
  for (int row = 0; row < kRays.h; ++row)
    for (int s = 0; s < kRays.w; ++s) {
      const double scale = t.at("range").at(row / 3, 0, 0, 0);
      double p[3], d[3], size = 0;
      for (int c = 0; c < 3; ++c) {
        p[c] = t.at("points").at(0, c, row, s) / scale, d[c] = t.at("direction").at(0, c, row, s);
        size += d[c] * d[c];
      }
      for (double& x : d) x /= std::sqrt(size);
      const double far = exit_of(p, d), piece = (far - kNear) / segments;
      for (int k = 0; k < segments; ++k) {
        for (int c = 0; c < 3; ++c) position.at(k, c, row, s) = p[c] + (kNear + (k + 0.5) * piece) * d[c];
        length.at(k, 0, row, s) = k + 1 < segments ? piece : piece / 2;
      }
    }
  return {position, length};
}

/// `reach`: how far from the camera rays start, in scales; the sphere ends at 3.
OpCase march_case(const std::string& label, int segments, double reach) {
  OpCase c{.stem = "march", .label = label, .kernels = {"march"}};
  c.inputs = {{"points", random_tensor(kRays, 1, -2 * reach, 2 * reach)},
              {"direction", random_tensor(kRays, 2)},
              {"range", Tensor(Shape{2, 3, 1, 1}, std::vector<double>{2, 1, 2, 3.5, 1, 4})}};
  c.build = [=](Graph&, const Values& v) {
    const Marched m = march(v.at("points"), v.at("direction"), v.at("range"), kPicture,
                            {.segments = segments, .near = kNear, .radius = kRadius, .jitter = false});
    return std::vector{m.position, m.length};
  };
  c.reference = [=](const Tensors& t) { return reference(t, segments); };
  // The exit is a difference of numbers of the size of the start's distance.
  c.roundings = 16, c.magnitude = 3 + reach * reach;
  c.no_gradient = "points and directions are detached";
  return c;
}

OP_CASES(march) { return {march_case("inside", 8, 1), march_case("one", 1, 1), march_case("outside", 5, 4)}; }

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
      EXPECT_NEAR(covered, 7, 1e-12);
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
