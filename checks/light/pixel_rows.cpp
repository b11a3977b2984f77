// Maps laid out pixel by pixel.
#include "host/ops/light/pixel_rows.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

OpCase rows_case(const std::string& label, const Shape& surface, const Shape& features) {
  OpCase c{.stem = "pixel_rows", .label = label, .kernels = {"pixel_rows"}};
  c.inputs = {{"surface", random_tensor(surface, 1)}, {"features", random_tensor(features, 2)}};
  c.build = [](Graph&, const Values& v) { return std::vector{pixel_rows(v.at("surface"), v.at("features"))}; };
  c.reference = [=](const Tensors& t) {
    Tensor rows(Shape{1, 1, surface.h * surface.w, surface.c});
    for (int y = 0; y < surface.h; ++y)
      for (int x = 0; x < surface.w; ++x)
        for (int k = 0; k < surface.c; ++k)
          rows.at(0, 0, y * surface.w + x, k) =
              t.at("surface").at(0, k, y, x) +
              t.at("features")
                  .at(0, k, static_cast<int>(std::floor((y + 0.5) * features.h / surface.h)),
                      static_cast<int>(std::floor((x + 0.5) * features.w / surface.w)));
    return std::vector{rows};
  };
  c.roundings = 1;
  c.no_gradient = "for inference: throws";
  return c;
}

OP_CASES(pixel_rows) {
  return {rows_case("half", {1, 16, 6, 8}, {1, 16, 3, 4}), rows_case("odd", {1, 5, 7, 11}, {1, 5, 4, 6}),
          rows_case("same", {1, 3, 2, 70}, {1, 3, 2, 70}), rows_case("finer", {1, 2, 3, 4}, {1, 2, 8, 12})};
}

}  // namespace
}  // namespace clerestory
