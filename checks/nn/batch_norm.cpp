#include "host/ops/nn/batch_norm.hpp"

#include <cmath>

#include "checks/op_case.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory {
namespace {

Tensor moments_of(const Tensor& x) {
  const Shape& s = x.shape;
  Tensor m({1, s.c, 1, 2});
  const double count = static_cast<double>(s.n * s.plane());
  for (int c = 0; c < s.c; ++c) {
    long double mean = 0, variance = 0;
    for (int n = 0; n < s.n; ++n)
      for (int y = 0; y < s.h; ++y)
        for (int i = 0; i < s.w; ++i) mean += x.at(n, c, y, i) / count;
    for (int n = 0; n < s.n; ++n)
      for (int y = 0; y < s.h; ++y)
        for (int i = 0; i < s.w; ++i) variance += std::pow(x.at(n, c, y, i) - mean, 2) / count;
    m.at(0, c, 0, 0) = static_cast<double>(mean), m.at(0, c, 0, 1) = static_cast<double>(variance);
  }
  return m;
}

Tensor normalised(const Tensor& x, const Tensor& m, const Tensor& gamma, const Tensor& beta, bool relu) {
  Tensor y(x.shape);
  for (int n = 0; n < x.shape.n; ++n)
    for (int c = 0; c < x.shape.c; ++c)
      for (int h = 0; h < x.shape.h; ++h)
        for (int w = 0; w < x.shape.w; ++w) {
          const double v =
              gamma.at(0, c, 0, 0) * (x.at(n, c, h, w) - m.at(0, c, 0, 0)) / std::sqrt(m.at(0, c, 0, 1) + 1e-5) +
              beta.at(0, c, 0, 0);
          y.at(n, c, h, w) = relu ? std::max(v, 0.0) : v;
        }
  return y;
}

constexpr Shape kShape{3, 4, 5, 7}, kChannel{1, 4, 1, 1};

}  // namespace

OP_CASES(batch_norm) {
  std::vector<OpCase> cases;
  cases.push_back({.stem = "batch_norm",
                   .label = "moments",
                   .kernels = {"channel_moments", "channel_moments_adjoint"},
                   .inputs = {{"x", random_tensor(kShape, 1, -1, 3)}},
                   .build = [](Graph&, const Values& v) { return std::vector<Value>{channel_moments(v.at("x"))}; },
                   .reference = [](const Tensors& t) { return std::vector<Tensor>{moments_of(t.at("x"))}; },
                   .roundings = 16,
                   .magnitude = 3,
                   .differentiate = {"x"}});
  // A mean a thousand times the deviation, many blocks: what a sum of squares would lose. The rounding of x - mean is
  // 1000 epsilon against deviations of 1, and the mean's own error enters squared.
  cases.push_back({.stem = "batch_norm",
                   .label = "moments_far_from_zero",
                   .kernels = {"channel_moments"},
                   .inputs = {{"x", random_tensor({2, 2, 101, 99}, 2, 999, 1001)}},
                   .build = [](Graph&, const Values& v) { return std::vector<Value>{channel_moments(v.at("x"))}; },
                   .reference = [](const Tensors& t) { return std::vector<Tensor>{moments_of(t.at("x"))}; },
                   .roundings = 32,  // mean: 1250 additions per lane, errors of either sign
                   .magnitude = 1000,
                   .differentiate = {"x"},
                   .step = 0.5,  // a quadratic: the difference is exact at any step
                   .gradient_roundings = 4000,
                   .differences = 5});
  for (const bool relu : {false, true})
    cases.push_back({.stem = "batch_norm",
                     .label = relu ? "normalise_relu" : "normalise",
                     .kernels = {"normalise_channels", "normalise_channels_adjoint"},
                     .inputs = {{"x", random_tensor(kShape, 3)},
                                {"moments", random_tensor({1, 4, 1, 2}, 4, 0.1, 1)},
                                {"gamma", random_tensor(kChannel, 5)},
                                {"beta", random_tensor(kChannel, 6)}},
                     .build =
                         [relu](Graph&, const Values& v) {
                           return std::vector<Value>{
                               normalise_channels(v.at("x"), v.at("moments"), v.at("gamma"), v.at("beta"), relu)};
                         },
                     .reference =
                         [relu](const Tensors& t) {
                           return std::vector<Tensor>{
                               normalised(t.at("x"), t.at("moments"), t.at("gamma"), t.at("beta"), relu)};
                         },
                     .roundings = 10,
                     .differentiate = {"x", "moments", "gamma", "beta"},
                     .gradient_roundings = 60});
  // Both together are batch normalisation: the moments' share of the gradient included.
  cases.push_back(
      {.stem = "batch_norm",
       .label = "whole",
       .kernels = {"channel_moments", "channel_moments_adjoint", "normalise_channels", "normalise_channels_adjoint"},
       .inputs = {{"x", random_tensor(kShape, 7)},
                  {"gamma", random_tensor(kChannel, 8)},
                  {"beta", random_tensor(kChannel, 9)}},
       .build =
           [](Graph&, const Values& v) {
             const Value x = v.at("x");
             return std::vector<Value>{normalise_channels(x, channel_moments(x), v.at("gamma"), v.at("beta"), true)};
           },
       .reference =
           [](const Tensors& t) {
             return std::vector<Tensor>{
                 normalised(t.at("x"), moments_of(t.at("x")), t.at("gamma"), t.at("beta"), true)};
           },
       .roundings = 20,
       .differentiate = {"x", "gamma", "beta"},
       .gradient_roundings = 100});
  // Others read x too: their gradient is added inside.
  OpCase beside = cases.back();
  beside.label = "beside_others";
  beside.build = [](Graph&, const Values& v) {
    const Value x = v.at("x");
    const Value y = normalise_channels(x, channel_moments(x), v.at("gamma"), v.at("beta"), true);
    return std::vector<Value>{y, scale(x, 3)};
  };
  beside.reference = [](const Tensors& t) {
    Tensor thrice = t.at("x");
    for (double& value : thrice.real) value *= 3;
    return std::vector<Tensor>{normalised(t.at("x"), moments_of(t.at("x")), t.at("gamma"), t.at("beta"), true), thrice};
  };
  cases.push_back(std::move(beside));
  // A channel that never varies: variance 0, y = beta.
  cases.push_back(
      {.stem = "batch_norm",
       .label = "constant_channel",
       .kernels = {"channel_moments", "normalise_channels"},
       .inputs = {{"x", Tensor({2, 4, 3, 3}, 0.7)},
                  {"gamma", random_tensor(kChannel, 8)},
                  {"beta", random_tensor(kChannel, 9)}},
       .build =
           [](Graph&, const Values& v) {
             const Value x = v.at("x");
             return std::vector<Value>{normalise_channels(x, channel_moments(x), v.at("gamma"), v.at("beta"), false)};
           },
       .reference =
           [](const Tensors& t) {
             return std::vector<Tensor>{
                 normalised(t.at("x"), moments_of(t.at("x")), t.at("gamma"), t.at("beta"), false)};
           },
       .roundings = 4 * 320,  // the mean's rounding is multiplied by 1 / sqrt(1e-5) = 316
       .magnitude = 1,
       .no_gradient = "a variance of zero has no two-sided difference at this step; the slope is tested above"});
  cases.push_back({.stem = "batch_norm",
                   .label = "running",
                   .kernels = {"channel_moments", "update_running", "running_moments"},
                   .inputs = {{"x", random_tensor(kShape, 10)}},
                   .states = {{"mean", random_tensor(kChannel, 11)}, {"variance", random_tensor(kChannel, 12, 0.5, 2)}},
                   .build =
                       [](Graph& g, const Values& v) {
                         const Value mean = g.state("mean", kChannel, Init::fixed(0)),
                                     variance = g.state("variance", kChannel, Init::fixed(1));
                         const Value moments = channel_moments(v.at("x"));
                         update_running(moments, mean, variance, v.at("x").shape().n * v.at("x").shape().plane(), 0.1);
                         return std::vector<Value>{running_moments(mean, variance)};
                       },
                   .reference =
                       [](const Tensors& t) {
                         const Tensor batch = moments_of(t.at("x"));
                         const double count = static_cast<double>(t.at("x").shape.n * t.at("x").shape.plane());
                         Tensor before({1, 4, 1, 2}), mean = t.at("mean"), variance = t.at("variance");
                         for (int c = 0; c < 4; ++c) {
                           before.at(0, c, 0, 0) = mean.at(0, c, 0, 0), before.at(0, c, 0, 1) = variance.at(0, c, 0, 0);
                           mean.at(0, c, 0, 0) = 0.9 * mean.at(0, c, 0, 0) + 0.1 * batch.at(0, c, 0, 0);
                           variance.at(0, c, 0, 0) =
                               0.9 * variance.at(0, c, 0, 0) + 0.1 * count / (count - 1) * batch.at(0, c, 0, 1);
                         }
                         return std::vector<Tensor>{before, mean, variance};
                       },
                   .roundings = 8,
                   .no_gradient = "statistics are written, not differentiated"});
  return cases;
}

}  // namespace clerestory
