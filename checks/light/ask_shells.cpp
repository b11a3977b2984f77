// Painted spheres in one kernel, against their definition.
#include "host/ops/light/ask_shells.hpp"

#include <cmath>

#include "checks/light/ask_shells_reference.hpp"
#include "checks/light/listed_rays.hpp"
#include "checks/light/shell_reference.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using namespace ask_shells_reference;

/// `list` empty: all rays.
Tensor plain_answer(const Tensors& t, const std::vector<int>& list) {
  const std::vector<Tensor> seen = looked_up_shells(t);
  const Shape& rays = t.at("direction").shape;
  Tensor radiance(Shape{1, 3, rays.h, rays.w});
  for (int ray = 0; ray < rays.plane(); ++ray) {
    if (!list.empty() && std::find(list.begin(), list.end(), ray) == list.end()) continue;
    const int p = ray / rays.w, s = ray % rays.w;
    double through = 1;
    for (int k = 0; k < seen[0].shape.n; ++k) {
      const double passes = std::exp(-seen[0].at(k, 3, p, s));
      for (int c = 0; c < 3; ++c) radiance.at(0, c, p, s) += through * (1 - passes) * seen[0].at(k, c, p, s);
      through *= passes;
    }
  }
  return radiance;
}

OpCase ask_case(const std::string& label, double reach, const Shape& map, Tensors inputs,
                const std::vector<int>& list = {}) {
  OpCase c{.stem = "ask_shells", .label = label, .kernels = {"pack_shells", "ask_shells"}, .inputs = std::move(inputs)};
  const Shape rays = c.inputs.at("direction").shape;
  c.build = [=](Graph& g, const Values& v) {
    return std::vector{ask(v, list.empty() ? RayList{} : list_of(g, list, rays))};
  };
  c.reference = [=](const Tensors& t) { return std::vector{plain_answer(t, list)}; };
  c.roundings = roundings_of(reach, map), c.magnitude = 2;
  c.no_gradient = "for inference: throws";
  return c;
}

/// Every third ray has no direction.
Tensors some_nowhere(Tensors inputs) {
  Tensor& direction = inputs.at("direction");
  for (std::size_t i = 0; i < direction.real.size(); ++i)
    if (i % static_cast<std::size_t>(direction.shape.plane()) % 3 == 0) direction.real[i] = 0;
  return inputs;
}

OP_CASES(ask_shells) {
  const Shape fine{1, 1, 8, 16}, odd{1, 1, 5, 12}, least{1, 1, 2, 2};
  return {ask_case("inside", 0.2, fine, shell_inputs(6, 32, 0.2, 1, fine)),
          ask_case("around", 1.2, odd, shell_inputs(6, 32, 1.2, 1, odd)),
          ask_case("outside", 5, least, shell_inputs(4, 16, 5, 1, least)),
          ask_case("point_per_row", 0.2, fine, shell_inputs(5, 16, 0.2, 1, fine, true)),
          ask_case("listed", 0.2, fine, shell_inputs(7, 16, 0.2, 1, fine), every(3, 112)),
          ask_case("one_ray", 0.2, fine, shell_inputs(2, 16, 0.2, 1, fine), {17}),
          ask_case("no_direction", 0.2, fine, some_nowhere(shell_inputs(3, 16, 0.2, 1, fine))),
          ask_case("clear", 0.2, fine, shell_inputs(2, 16, 0.2, 0, fine)),
          ask_case("thin", 0.2, fine, shell_inputs(2, 16, 0.2, 1e-7, fine)),
          ask_case("solid", 0.2, fine, shell_inputs(2, 16, 0.2, 1e6, fine))};
}

}  // namespace
}  // namespace clerestory
