#include "host/ops/light/mix_light.hpp"

#include <algorithm>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

std::vector<Tensor> reference(const Tensors& in) {
  const Tensor &near = in.at("near"), &far = in.at("far"), &u = in.at("u");
  Tensor y(near.shape);
  for (int c = 0; c < 3; ++c)
    for (int p = 0; p < y.shape.h; ++p)
      for (int s = 0; s < y.shape.w; ++s)
        y.at(0, c, p, s) = near.at(0, c, p, s) + u.at(0, 0, p, s) * (far.at(0, c, p, s) - near.at(0, c, p, s));
  return {y};
}

OpCase make_case(const std::string& label, int pixels, int samples, double low, double high, double brightest) {
  OpCase c;
  c.stem = "mix_light", c.label = label, c.kernels = {"mix_light"};
  const Shape rays{1, 3, pixels, samples};
  c.inputs = {{"near", random_tensor(rays, 1, 0, brightest)},
              {"far", random_tensor(rays, 2, 0, 1)},
              {"u", random_tensor({1, 1, pixels, samples}, 3, low, high)}};
  c.build = [](Graph&, const Values& v) { return std::vector{mix_light(v.at("near"), v.at("far"), v.at("u"))}; };
  c.reference = reference;
  c.roundings = 4, c.magnitude = brightest;
  c.differentiate = {"near", "far", "u"};
  // Linear in each input: a difference is exact at any step but for rounding of sums of some 100 products as large as
  // `brightest`, 1e-16 * 1e5 of it, against gradients that are as small as the least u.
  c.step = 1, c.gradient_tolerance = 1e-11 / std::max(low, 1e-7);
  return c;
}

}  // namespace

OP_CASES(mix_light) {
  auto gradients = make_case("between", 3, 16, 0, 1, 2);
  gradients.kernels.push_back("mix_light_adjoint");
  return {gradients, make_case("sure", 2, 32, 1e-7, 1e-6, 1000), make_case("unsure", 2, 16, 1, 1 + 1e-12, 1000)};
}

}  // namespace clerestory
