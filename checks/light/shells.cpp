// Painted spheres, against their definition.
#include "host/ops/light/shells.hpp"

#include "checks/light/shell_reference.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

/// `reach`: how far rays start from the camera, in scales.
OpCase shells_case(const std::string& label, const Shape& rays, double reach, int rows, int columns) {
  OpCase c{.stem = "shells", .label = label, .kernels = {"look_up_shells", "sum_shells"}};
  c.inputs = {{"shells", random_tensor({3, 4, rows, columns}, 1, 0, 2)},
              {"points", random_tensor(rays, 2, -2 * reach, 2 * reach)},
              {"direction", random_tensor(rays, 3)},
              {"range", Tensor({1, 3, 1, 1}, std::vector<double>{2, 1, 2})}};
  c.build = [=](Graph&, const Values& v) {
    const ShellSamples s =
        look_up_shells(v.at("shells"), v.at("points"), v.at("direction"), v.at("range"), kShellRadii);
    return std::vector{s.value, s.met};
  };
  c.reference = [](const Tensors& t) { return looked_up_shells(t); };
  // A place on the map is off by a few units in the last place of the start's distance, times the columns.
  c.roundings = 64.0 * columns * (1 + reach), c.magnitude = 2;
  c.differentiate = {"shells"};
  c.step = 1e-2, c.gradient_tolerance = 1e-10;  // linear: a difference is exact but for rounding
  c.gradient_roundings = 64 * c.roundings;      // a texel sums the shares of many rays
  return c;
}

OP_CASES(shells) {
  return {shells_case("inside", {1, 3, 6, 32}, 0.2, 8, 16), shells_case("around", {1, 3, 6, 32}, 1.2, 5, 12),
          shells_case("outside", {1, 3, 4, 16}, 5, 2, 2)};
}

}  // namespace
}  // namespace clerestory
