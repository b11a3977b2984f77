#include "host/ops/nn/group_norm.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

Tensor reference(const Tensor& x, const Tensor& gamma, const Tensor& beta, int groups, bool relu) {
  const Shape& s = x.shape;
  Tensor out(s);
  const int channels = s.c / groups;
  const double count = static_cast<double>(channels * s.plane());
  for (int n = 0; n < s.n; ++n)
    for (int g = 0; g < groups; ++g) {
      const auto each = [&](auto f) {
        for (int c = g * channels; c < (g + 1) * channels; ++c)
          for (int y = 0; y < s.h; ++y)
            for (int i = 0; i < s.w; ++i) f(c, y, i);
      };
      long double mean = 0, variance = 0;
      each([&](int c, int y, int i) { mean += x.at(n, c, y, i) / count; });
      each([&](int c, int y, int i) { variance += std::pow(x.at(n, c, y, i) - mean, 2) / count; });
      const double s_inverse = 1 / std::sqrt(static_cast<double>(variance) + 1e-5);
      each([&](int c, int y, int i) {
        const double v =
            gamma.at(0, c, 0, 0) * (x.at(n, c, y, i) - static_cast<double>(mean)) * s_inverse + beta.at(0, c, 0, 0);
        out.at(n, c, y, i) = relu ? std::max(v, 0.0) : v;
      });
    }
  return out;
}

OpCase group_case(const std::string& label, Tensor x, int groups, bool relu) {
  const Shape parameter{1, x.shape.c, 1, 1};
  return {
      .stem = "group_norm",
      .label = label,
      .kernels = {"group_normalise", "group_normalise_adjoint"},
      .inputs = {{"x", std::move(x)}, {"gamma", random_tensor(parameter, 2)}, {"beta", random_tensor(parameter, 3)}},
      .build =
          [=](Graph&, const Values& v) {
            return std::vector<Value>{group_norm(v.at("x"), v.at("gamma"), v.at("beta"), groups, relu)};
          },
      .reference =
          [=](const Tensors& t) {
            return std::vector<Tensor>{reference(t.at("x"), t.at("gamma"), t.at("beta"), groups, relu)};
          },
      .roundings = 20,
      .differentiate = {"x", "gamma", "beta"},
      .gradient_roundings = 100};
}

}  // namespace

OP_CASES(group_norm) {
  std::vector<OpCase> cases{
      group_case("two_groups", random_tensor({2, 6, 5, 7}, 1), 2, false),
      group_case("two_groups_relu", random_tensor({2, 6, 5, 7}, 1), 2, true),
      group_case("one_channel_each", random_tensor({1, 4, 3, 11}, 4), 4, true),
      group_case("one_group", random_tensor({3, 4, 4, 4}, 5), 1, true),
  };
  // Far from zero: x - mean rounds at 100 epsilon against a deviation of 0.58, and differences lose as much.
  OpCase far = group_case("far_from_zero", random_tensor({2, 4, 33, 35}, 6, 99, 101), 2, false);
  far.roundings = 600, far.gradient_roundings = 4000, far.differences = 5, far.gradient_tolerance = 1e-6;
  cases.push_back(far);
  return cases;
}

}  // namespace clerestory
