// Features gathered at hits.
#include "host/ops/light/gather_rays.hpp"

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

constexpr Shape kMap{2, 5, 4, 6};

constexpr int kRows = 2 * 24;

OP_CASES(gather_rays) {
  OpCase c{.stem = "gather_rays", .label = "batch"};
  c.kernels = {"gather_rays", "sum_segments"};
  c.inputs = {{"map", random_tensor(kMap, 1)}, {"hit", random_ints({1, 1, kRows, 16}, 2, -4, 24)}};
  c.build = [](Graph&, const Values& v) { return std::vector{gather_rays(v.at("map"), v.at("hit"))}; };
  c.reference = [](const Tensors& t) {
    Tensor y(Shape{1, kMap.c, kRows, 16});
    for (int p = 0; p < kRows; ++p)
      for (int s = 0; s < 16; ++s) {
        const int pixel = t.at("hit").integer[static_cast<std::size_t>(p * 16 + s)];
        for (int k = 0; k < kMap.c; ++k)
          y.at(0, k, p, s) = pixel < 0 ? 0 : t.at("map").at(p / 24, k, pixel / kMap.w, pixel % kMap.w);
      }
    return std::vector{y};
  };
  c.differentiate = {"map"};
  c.step = 1e-2, c.gradient_tolerance = 1e-10;  // linear: a difference is exact but for rounding
  return {c};
}

}  // namespace
}  // namespace clerestory
