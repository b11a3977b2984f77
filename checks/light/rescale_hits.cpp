// Hit pixels as cells of other grids.
#include "host/ops/light/rescale_hits.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

OpCase rescale_case(const std::string& label, const Shape& from, const Shape& to) {
  OpCase c{.stem = "rescale_hits", .label = label, .kernels = {"rescale_hits"}};
  c.inputs = {{"hit", random_ints({1, 1, 9, 32}, 2, -1, static_cast<int>(from.plane()))}};
  c.build = [=](Graph&, const Values& v) { return std::vector{rescale_hits(v.at("hit"), from, to)}; };
  c.reference = [=](const Tensors& t) {
    Tensor y = t.at("hit");
    for (std::int32_t& pixel : y.integer) {
      if (pixel < 0) continue;
      const double x = (pixel % from.w + 0.5) * to.w / from.w, row = (pixel / from.w + 0.5) * to.h / from.h;
      pixel = static_cast<int>(std::floor(row)) * to.w + static_cast<int>(std::floor(x));
    }
    return std::vector{y};
  };
  c.no_gradient = "pixels are discrete";
  return c;
}

OP_CASES(rescale_hits) {
  return {rescale_case("half", {1, 1, 6, 8}, {1, 1, 3, 4}), rescale_case("odd", {1, 1, 7, 11}, {1, 1, 4, 6}),
          rescale_case("finer", {1, 1, 3, 4}, {1, 1, 8, 12})};
}

}  // namespace
}  // namespace clerestory
