#include "host/ops/nn/depthwise.hpp"

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

Tensor convolved(const Tensors& t, int stride) {
  const Tensor &x = t.at("x"), &w = t.at("w"), &bias = t.at("bias");
  const Shape& s = x.shape;
  const auto rounded_up = [&](int size) { return (size - 1) / stride + 1; };
  // As many zeros before as behind, or one more behind.
  const auto before = [&](int size) {
    const int reach = (rounded_up(size) - 1) * stride + w.shape.h;
    return reach > size ? (reach - size) / 2 : 0;
  };
  Tensor y({s.n, s.c, rounded_up(s.h), rounded_up(s.w)});
  for (int n = 0; n < s.n; ++n)
    for (int c = 0; c < s.c; ++c)
      for (int j = 0; j < y.shape.h; ++j)
        for (int i = 0; i < y.shape.w; ++i) {
          double sum = bias.at(0, c, 0, 0);
          for (int ky = 0; ky < w.shape.h; ++ky)
            for (int kx = 0; kx < w.shape.w; ++kx) {
              const int row = j * stride + ky - before(s.h), column = i * stride + kx - before(s.w);
              if (row >= 0 && row < s.h && column >= 0 && column < s.w)
                sum += w.at(c, 0, ky, kx) * x.at(n, c, row, column);
            }
          y.at(n, c, j, i) = sum;
        }
  return y;
}

}  // namespace

OP_CASES(depthwise) {
  struct Plane {
    Shape x;
    const char* what;
  };
  // Planes of a few pixels, of odd and even sizes, and of several tiles both ways.
  const std::vector<Plane> planes{{{2, 3, 6, 8}, "even"},
                                  {{2, 2, 7, 5}, "odd"},
                                  {{1, 3, 1, 2}, "smaller_than_the_kernel"},
                                  {{1, 1, 3, 37}, "lanes_and_a_rest"},
                                  {{1, 2, 93, 237}, "tiles"}};
  std::vector<OpCase> cases;
  for (const Plane& p : planes)
    for (const int kernel : {3, 5})
      for (const int stride : {1, 2}) {
        OpCase c{.stem = "depthwise",
                 .label = fmt::format("{}_{}x{}_stride_{}", p.what, kernel, kernel, stride),
                 .kernels = {"depthwise", "depthwise_data"},
                 .inputs = {{"x", random_tensor(p.x, 1)},
                            {"w", random_tensor({p.x.c, 1, kernel, kernel}, 2)},
                            {"bias", random_tensor({1, p.x.c, 1, 1}, 3)}},
                 .build =
                     [stride](Graph&, const Values& v) {
                       return std::vector<Value>{depthwise(v.at("x"), v.at("w"), v.at("bias"), stride)};
                     },
                 .reference = [stride](const Tensors& t) { return std::vector<Tensor>{convolved(t, stride)}; },
                 .roundings = static_cast<double>(kernel * kernel + 1),
                 .differentiate = {"x"}};
        c.differences = 60;
        cases.push_back(c);
        // These gradients sum over the plane, the largest of which has 22,000 pixels in sums of 16 lanes.
        c.label += "_weights", c.kernels = {"depthwise", "depthwise_weights"}, c.differentiate = {"w", "bias"};
        c.gradient_roundings = 4 * c.roundings + static_cast<double>(p.x.plane()) / 16;
        cases.push_back(c);
      }
  return cases;
}

}  // namespace clerestory
