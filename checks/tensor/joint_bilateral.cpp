#include "host/ops/tensor/joint_bilateral.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

Tensor reference(const Tensors& in, double sigma) {
  const Tensor &x = in.at("x"), &low = in.at("low"), &guide = in.at("guide");
  Tensor y({x.shape.n, x.shape.c, guide.shape.h, guide.shape.w});
  for (int n = 0; n < y.shape.n; ++n)
    for (int j = 0; j < y.shape.h; ++j)
      for (int i = 0; i < y.shape.w; ++i) {
        const double v = (j + 0.5) * low.shape.h / y.shape.h - 0.5, u = (i + 0.5) * low.shape.w / y.shape.w - 0.5;
        double weights = 0;
        std::vector<double> sums(static_cast<std::size_t>(x.shape.c), 0);
        for (int qy = static_cast<int>(std::floor(v)) - 1; qy <= std::floor(v) + 2; ++qy)
          for (int qx = static_cast<int>(std::floor(u)) - 1; qx <= std::floor(u) + 2; ++qx) {
            const int cy = std::clamp(qy, 0, low.shape.h - 1), cx = std::clamp(qx, 0, low.shape.w - 1);
            double unlike = 0;
            for (int c = 0; c < 3; ++c) unlike += std::pow(guide.at(n, c, j, i) - low.at(n, c, cy, cx), 2);
            const double k = std::exp(-0.5 * ((v - qy) * (v - qy) + (u - qx) * (u - qx))) *
                             (std::exp(-unlike / (2 * sigma * sigma)) + 1.0 / 1024);
            weights += k;
            for (int c = 0; c < x.shape.c; ++c) sums[static_cast<std::size_t>(c)] += k * x.at(n, c, cy, cx);
          }
        for (int c = 0; c < x.shape.c; ++c) y.at(n, c, j, i) = sums[static_cast<std::size_t>(c)] / weights;
      }
  return y;
}

OpCase make_case(const std::string& label, Shape x, int h, int w, double sigma, int padding = 0) {
  OpCase c;
  c.stem = "joint_bilateral", c.label = label, c.kernels = {"joint_bilateral"};
  c.inputs = {{"x", random_tensor({x.n, x.c, x.h + padding, x.w + 2 * padding}, 1)},
              {"low", random_tensor({x.n, 3, x.h, x.w}, 2, 0, 1)},
              {"guide", random_tensor({x.n, 3, h, w}, 3, 0, 1)}};
  c.build = [sigma](Graph&, const Values& v) {
    return std::vector{joint_bilateral(v.at("x"), v.at("low"), v.at("guide"), sigma)};
  };
  c.reference = [sigma](const Tensors& in) { return std::vector{reference(in, sigma)}; };
  // An exponent of size 3 / (2 sigma^2) is rounded to that many units, and so is each weight.
  c.roundings = 32 + 3 / (2 * sigma * sigma), c.magnitude = 1;
  c.no_gradient = "it serves finished maps";
  return c;
}

}  // namespace

OP_CASES(joint_bilateral) {
  return {make_case("enlarges", {2, 3, 6, 8}, 15, 21, 0.1), make_case("shrinks", {1, 1, 9, 7}, 4, 3, 0.3),
          make_case("one_pixel", {1, 2, 1, 1}, 3, 5, 0.1), make_case("nothing_alike", {1, 2, 5, 5}, 11, 10, 0.005),
          make_case("padded", {2, 2, 5, 6}, 9, 14, 0.2, 3)};
}

}  // namespace clerestory
