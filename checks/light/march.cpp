// Points along rays, against the sphere's definition.
#include "host/ops/light/march.hpp"

#include <cmath>
#include <optional>

#include "checks/op_case.hpp"
#include "checks/shade/hash_reference.hpp"

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

double share_of(std::uint32_t seed, int row, int sample, int k) {
  const auto block = static_cast<std::uint32_t>(k / 4), place = static_cast<std::uint32_t>(k % 4);
  return hashed(seed ^ 0x6d617263u, static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(sample), block)[place];
}

/// In the middle of each piece, or with a seed where its random numbers say.
std::vector<Tensor> reference(const Tensors& t, int segments, std::optional<std::uint32_t> seed) {
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
      double here = 0;
      for (int k = 0; k < segments; ++k) {
        const double share = seed ? share_of(*seed, row, s, k) : 0.5, before = here;
        here = kNear + (k + share) * piece;
        for (int c = 0; c < 3; ++c) position.at(k, c, row, s) = p[c] + here * d[c];
        if (k > 0) length.at(k - 1, 0, row, s) = here - before;
      }
      length.at(segments - 1, 0, row, s) = far - here;
    }
  return {position, length};
}

/// `reach`: how far from the camera rays start, in scales; the sphere ends at 3.
OpCase march_case(const std::string& label, int segments, double reach, bool jitter = false) {
  OpCase c{.stem = "march", .label = label, .kernels = {"march"}};
  c.inputs = {{"points", random_tensor(kRays, 1, -2 * reach, 2 * reach)},
              {"direction", random_tensor(kRays, 2)},
              {"range", Tensor(Shape{2, 3, 1, 1}, std::vector<double>{2, 1, 2, 3.5, 1, 4})}};
  c.build = [=](Graph&, const Values& v) {
    const Marched m = march(v.at("points"), v.at("direction"), v.at("range"), kPicture,
                            {.segments = segments, .near = kNear, .radius = kRadius, .jitter = jitter});
    return std::vector{m.position, m.length};
  };
  c.reference = [=, seed = c.seed](const Tensors& t) {
    return reference(t, segments, jitter ? std::optional(seed) : std::nullopt);
  };
  // The exit is a difference of numbers of the size of the start's distance.
  c.roundings = 16, c.magnitude = 3 + reach * reach;
  c.no_gradient = "points and directions are detached";
  return c;
}

OP_CASES(march) {
  return {march_case("inside", 8, 1), march_case("one", 1, 1), march_case("outside", 5, 4),
          march_case("jittered", 6, 1, true)};
}

}  // namespace
}  // namespace clerestory
