#include "host/ops/light/composite.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

std::vector<Tensor> reference(const Tensors& t) {
  const Tensor &density = t.at("density"), &colour = t.at("colour"), &length = t.at("length");
  const Shape& s = density.shape;
  Tensor radiance(Shape{1, 3, s.h, s.w}), left(Shape{1, 1, s.h, s.w});
  for (int p = 0; p < s.h; ++p)
    for (int i = 0; i < s.w; ++i) {
      long double through = 1;
      for (int k = 0; k < s.n; ++k) {
        const long double thickness = static_cast<long double>(density.at(k, 0, p, i)) * length.at(k, 0, p, i);
        const long double share = -through * std::expm1(-thickness);
        for (int c = 0; c < 3; ++c) radiance.at(0, c, p, i) += static_cast<double>(share * colour.at(k, c, p, i));
        through *= std::exp(-thickness);
      }
      left.at(0, 0, p, i) = static_cast<double>(through);
    }
  return {radiance, left};
}

/// thickness: the largest optical depth of a segment.
OpCase composite_case(const std::string& label, int segments, double thickness) {
  const Shape rays{segments, 1, 3, 32};
  OpCase c{.stem = "composite", .label = label, .kernels = {"composite", "composite_adjoint"}};
  c.inputs = {{"density", random_tensor(rays, 1, 0, thickness)},
              {"colour", random_tensor({segments, 3, 3, 32}, 2, 0, 4)},
              {"length", random_tensor(rays, 3, 0.2, 1)}};
  c.build = [](Graph&, const Values& v) {
    const Composited out = composite(v.at("density"), v.at("colour"), v.at("length"));
    return std::vector{out.radiance, out.transmittance};
  };
  c.reference = reference;
  // A sum of K shares; an optical depth of t is rounded to eps t, which the exponential makes relative.
  c.roundings = segments * (1 + thickness) + 8;
  c.differentiate = {"density", "colour"};
  c.step = 1e-4 * std::min(thickness, 1.0);
  return c;
}

OP_CASES(composite) {
  OpCase thin = composite_case("thin", 8, 1e-6);
  // Light through a millionth of an optical depth: its own size is what rounding is measured against.
  thin.magnitude = 0;
  thin.build = [](Graph&, const Values& v) {
    return std::vector{composite(v.at("density"), v.at("colour"), v.at("length")).radiance};
  };
  thin.reference = [](const Tensors& t) { return std::vector{reference(t)[0]}; };
  thin.step = 1e-8, thin.gradient_tolerance = 1e-6;  // differences of sums of 1e-6: 1e-22 over the step
  OpCase solid = composite_case("solid", 5, 200);
  for (double& x : solid.inputs["density"].real) x = x < 60 ? 0 : x;  // empty segments between opaque ones
  solid.step = 1e-3;
  return {composite_case("between", 6, 2), thin, solid, composite_case("one_segment", 1, 1)};
}

}  // namespace
}  // namespace clerestory
