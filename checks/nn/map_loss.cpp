#include "host/ops/nn/map_loss.hpp"

#include <cmath>
#include <limits>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

enum class Kind { Squared, Log, ScaledLog, Cosine };

constexpr double kFactor = 0.4;

double masked(const Tensor& a, const Tensor& b, const Tensor& mask, const Tensor* scale, Kind kind) {
  const Shape& s = a.shape;
  long double sum = 0, count = 0;
  for (int n = 0; n < s.n; ++n)
    for (int y = 0; y < s.h; ++y)
      for (int x = 0; x < s.w; ++x) {
        const double m = mask.at(n, 0, y, x);
        count += m;
        if (m == 0) continue;
        double e = 0;
        for (int c = 0; c < s.c; ++c) {
          const double p = a.at(n, c, y, x), t = b.at(n, c, y, x);
          if (kind == Kind::Squared)
            e += (p - t) * (p - t);
          else if (kind == Kind::Cosine)
            e += p * t;
          else
            e += std::pow(std::log(1 + std::max(0.0, (scale ? scale->at(n, 0, 0, 0) : 1) * p)) - std::log(1 + t), 2);
        }
        sum += m * (kind == Kind::Cosine ? std::abs(1 - e) : e);
      }
  return count > 0 ? static_cast<double>(kFactor * sum / count) : 0;
}

Value loss_of(const Values& v, Kind kind) {
  switch (kind) {
    case Kind::Squared:
      return squared_loss(v.at("a"), v.at("b"), v.at("mask"), kFactor);
    case Kind::Log:
      return log_loss(v.at("a"), v.at("b"), v.at("mask"), kFactor);
    case Kind::ScaledLog:
      return log_loss(v.at("a"), v.at("b"), v.at("mask"), kFactor, v.at("scale"));
    case Kind::Cosine:
      return cosine_loss(v.at("a"), v.at("b"), v.at("mask"), kFactor);
  }
  return {};
}

/// A mask of zeros, ones and fractions; NaN in the truth where it is zero.
OpCase loss_case(const std::string& label, Kind kind, Shape s, double low) {
  Tensor a = random_tensor(s, 1, low, 1.5), b = random_tensor(s, 2, kind == Kind::Cosine ? -1 : 0, 1.5);
  Tensor mask = random_tensor({s.n, 1, s.h, s.w}, 3, -0.5, 1.5);
  for (double& m : mask.real) m = std::clamp(m, 0.0, 1.0);
  for (int n = 0; n < s.n; ++n)
    for (int c = 0; c < s.c; ++c)
      for (int y = 0; y < s.h; ++y)
        for (int x = 0; x < s.w; ++x)
          if (mask.at(n, 0, y, x) == 0) b.at(n, c, y, x) = std::numeric_limits<double>::quiet_NaN();
  OpCase c{.stem = "map_loss",
           .label = label,
           .kernels = {"map_loss", "map_loss_total", "map_loss_adjoint"},
           .inputs = {{"a", a}, {"b", b}, {"mask", mask}},
           .build = [kind](Graph&, const Values& v) { return std::vector<Value>{loss_of(v, kind)}; },
           .reference =
               [kind](const Tensors& t) {
                 const Tensor* scale = kind == Kind::ScaledLog ? &t.at("scale") : nullptr;
                 return std::vector<Tensor>{Tensor({}, masked(t.at("a"), t.at("b"), t.at("mask"), scale, kind))};
               },
           .roundings = 24,
           .magnitude = 1,
           .differentiate = {"a"}};
  if (kind == Kind::ScaledLog) c.inputs["scale"] = random_tensor({s.n, 1, 1, 1}, 4, 0.5, 2);
  return c;
}

Tensor scale_reference(const Tensor& a, const Tensor& b, const Tensor& mask) {
  Tensor s({a.shape.n, 1, 1, 1});
  for (int n = 0; n < a.shape.n; ++n) {
    long double ab = 0, aa = 0;
    for (int y = 0; y < a.shape.h; ++y)
      for (int x = 0; x < a.shape.w; ++x) {
        ab += mask.at(n, 0, y, x) * a.at(n, 0, y, x) * b.at(n, 0, y, x);
        aa += mask.at(n, 0, y, x) * a.at(n, 0, y, x) * a.at(n, 0, y, x);
      }
    s.at(n, 0, 0, 0) = std::clamp(static_cast<double>(ab / std::max(aa, 1e-5L)), 0.001, 1000.0);
  }
  return s;
}

OpCase scale_case(const std::string& label, Tensor a, Tensor b, Tensor mask) {
  return {.stem = "map_loss",
          .label = "scale_" + label,
          .kernels = {"least_squares_scale"},
          .inputs = {{"a", std::move(a)}, {"b", std::move(b)}, {"mask", std::move(mask)}},
          .build =
              [](Graph&, const Values& v) {
                return std::vector<Value>{least_squares_scale(v.at("a"), v.at("b"), v.at("mask"))};
              },
          .reference =
              [](const Tensors& t) { return std::vector<Tensor>{scale_reference(t.at("a"), t.at("b"), t.at("mask"))}; },
          .roundings = 32,
          .no_gradient = "the scale is detached by definition"};
}

}  // namespace

OP_CASES(map_loss) {
  std::vector<OpCase> cases{
      loss_case("squared", Kind::Squared, {2, 2, 5, 7}, -1),
      loss_case("log", Kind::Log, {2, 3, 5, 7}, -0.5),  // negative predictions: the closed branch
      loss_case("log_scaled", Kind::ScaledLog, {3, 1, 5, 7}, -0.5),
      loss_case("cosine", Kind::Cosine, {2, 3, 5, 7}, -1),  // products on both sides of 1
      loss_case("squared_blocks", Kind::Squared, {2, 2, 97, 101}, -1),
  };
  cases.back().roundings = 200, cases.back().differences = 8;  // 9800 terms a picture in 16 lanes and two blocks
  OpCase empty = loss_case("empty_mask", Kind::Squared, {2, 1, 3, 3}, -1);
  empty.inputs["mask"] = Tensor({2, 1, 3, 3});
  empty.differentiate.clear(), empty.kernels.pop_back(), empty.no_gradient = "an empty mask has no terms";
  cases.push_back(empty);
  OpCase faint = loss_case("faint_mask", Kind::Squared, {1, 2, 3, 3}, -1);  // weights of less than 1 in all
  for (double& m : faint.inputs["mask"].real) m *= 0.01;
  cases.push_back(faint);
  const Shape s{3, 1, 9, 11};
  const Tensor mask = random_ints(s, 5, 0, 2);
  const Tensor weights(s, std::vector<double>(mask.integer.begin(), mask.integer.end()));
  cases.push_back(scale_case("usual", random_tensor(s, 6, 0, 1), random_tensor(s, 7, 0, 5), weights));
  Tensor fractions = random_tensor(s, 8, 0.1, 1);
  cases.push_back(scale_case("fractions", random_tensor(s, 6, 0, 1), random_tensor(s, 7, 0, 5), fractions));
  // A sum of squares below the floor; the scale that it gives is within its bounds: 99 pixels, 1e-8 and 2e-8 each,
  // 0.198.
  cases.push_back(scale_case("below_the_floor", Tensor(s, 1e-4), Tensor(s, 2e-4), Tensor(s, 1)));
  cases.push_back(scale_case("upper_end", Tensor(s, 1e-4), Tensor(s, 5), Tensor(s, 1)));
  cases.push_back(scale_case("lower_end", Tensor(s, 0), random_tensor(s, 7, 0, 5), weights));
  return cases;
}

}  // namespace clerestory
