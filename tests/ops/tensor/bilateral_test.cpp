#include "host/ops/tensor/bilateral.hpp"

#include <cmath>

#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

Tensor reference(const Tensor& x, const Tensor& small, const Tensor& guide, const BilateralSpec& spec) {
  const int valid_h = spec.valid_height ? spec.valid_height : x.shape.h, valid_w = spec.valid_width ? spec.valid_width : x.shape.w;
  Tensor y({x.shape.n, x.shape.c, guide.shape.h, guide.shape.w});
  for (int n = 0; n < y.shape.n; ++n)
    for (int j = 0; j < y.shape.h; ++j)
      for (int i = 0; i < y.shape.w; ++i) {
        const double v = (j + 0.5) * valid_h / y.shape.h - 0.5, u = (i + 0.5) * valid_w / y.shape.w - 0.5;
        double total = 0;
        std::vector<double> sums(static_cast<std::size_t>(y.shape.c));
        for (int b = -2; b <= 2; ++b)
          for (int a = -2; a <= 2; ++a) {
            const int qy = std::clamp(static_cast<int>(std::floor(v + 0.5)) + b, 0, valid_h - 1);
            const int qx = std::clamp(static_cast<int>(std::floor(u + 0.5)) + a, 0, valid_w - 1);
            double difference = 0;
            for (int g = 0; g < guide.shape.c; ++g) difference += std::pow(guide.at(n, g, j, i) - small.at(n, g, qy, qx), 2);
            const double k = std::exp(-((v - qy) * (v - qy) + (u - qx) * (u - qx)) / (2 * spec.space * spec.space)) *
                             std::exp(-std::min(difference / (2 * spec.range * spec.range), 9.2));
            total += k;
            for (int c = 0; c < y.shape.c; ++c) sums[static_cast<std::size_t>(c)] += k * x.at(n, c, qy, qx);
          }
        for (int c = 0; c < y.shape.c; ++c) y.at(n, c, j, i) = sums[static_cast<std::size_t>(c)] / total;
      }
  return y;
}

OpCase bilateral_case(const std::string& label, Shape x, int guides, int height, int width, BilateralSpec spec) {
  return {.stem = "bilateral",
          .label = label,
          .kernels = {"bilateral_upsample"},
          .inputs = {{"x", random_tensor(x, 1)},
                     {"small", random_tensor({x.n, guides, x.h, x.w}, 2, 0, 1)},
                     {"guide", random_tensor({x.n, guides, height, width}, 3, 0, 1)}},
          .build = [spec](Graph&, const Values& v) {
            return std::vector<Value>{bilateral_upsample(v.at("x"), v.at("small"), v.at("guide"), spec)};
          },
          .reference = [spec](const Tensors& t) {
            return std::vector<Tensor>{reference(t.at("x"), t.at("small"), t.at("guide"), spec)};
          },
          // The exponent reaches 9.2 + 8 and rounds at epsilon times that before it is raised.
          .roundings = 64,
          .magnitude = 1,
          .no_gradient = "finishes predictions; nothing is trained through it"};
}

}  // namespace

OP_CASES(bilateral) {
  // Ratios that put no output pixel's centre exactly between two inputs, where rounding chooses the window.
  return {bilateral_case("larger", {2, 3, 6, 7}, 3, 19, 23, {.space = 1, .range = 0.3}),
          bilateral_case("sharp", {1, 2, 6, 7}, 1, 19, 23, {.space = 1, .range = 0.01}),
          bilateral_case("padded", {1, 1, 8, 8}, 3, 17, 19, {.space = 0.7, .range = 0.2, .valid_height = 5, .valid_width = 6}),
          bilateral_case("smaller", {1, 2, 21, 23}, 3, 8, 10, {.space = 1, .range = 0.3})};
}

}  // namespace clerestory
