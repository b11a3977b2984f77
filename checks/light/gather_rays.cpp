// Features gathered at hits.
#include "host/ops/light/gather_rays.hpp"

#include <algorithm>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

/// `rows` rows of rays into maps of 4 x 6; rows beyond the pictures' planes are of the last picture.
OpCase gather_case(const std::string& label, const Shape& map, int rows) {
  OpCase c{.stem = "gather_rays", .label = label};
  c.kernels = {"gather_rays", "sum_segments"};
  c.inputs = {{"map", random_tensor(map, 1)}, {"hit", random_ints({1, 1, rows, 16}, 2, -4, 24)}};
  c.build = [](Graph&, const Values& v) { return std::vector{gather_rays(v.at("map"), v.at("hit"))}; };
  c.reference = [=](const Tensors& t) {
    Tensor y(Shape{1, map.c, rows, 16});
    for (int p = 0; p < rows; ++p)
      for (int s = 0; s < 16; ++s) {
        const int pixel = t.at("hit").integer[static_cast<std::size_t>(p * 16 + s)];
        const int picture = std::min(p / 24, static_cast<int>(map.n) - 1);
        for (int k = 0; k < map.c; ++k)
          y.at(0, k, p, s) = pixel < 0 ? 0 : t.at("map").at(picture, k, pixel / map.w, pixel % map.w);
      }
    return std::vector{y};
  };
  c.differentiate = {"map"};
  c.step = 1e-2, c.gradient_tolerance = 1e-10;  // linear: a difference is exact but for rounding
  return c;
}

OP_CASES(gather_rays) {
  return {gather_case("batch", {2, 5, 4, 6}, 48), gather_case("more_rows_than_pixels", {1, 5, 4, 6}, 30)};
}

}  // namespace
}  // namespace clerestory
