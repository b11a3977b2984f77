#include "host/ops/tensor/resize.hpp"

#include <cmath>

#include "checks/op_case.hpp"
#include "checks/tensor/shapes.hpp"

namespace clerestory {
namespace {

double hat(double distance) { return std::max(0.0, 1 - std::abs(distance)); }

double place(int i, int ins, int outs, Aligned aligned) {
  if (aligned == Aligned::Centres) return std::clamp(((2 * i + 1) * ins - outs) / (2.0 * outs), 0.0, ins - 1.0);
  return outs > 1 ? static_cast<double>(i) * (ins - 1) / (outs - 1) : 0;
}

Tensor bilinear(const Tensor& x, int h, int w, Aligned aligned) {
  const Shape& s = x.shape;
  return over(s, h, w, [&](int n, int c, int j, int i) {
    const double v = place(j, s.h, h, aligned), u = place(i, s.w, w, aligned);
    double sum = 0;
    for (int y = 0; y < s.h; ++y)
      for (int k = 0; k < s.w; ++k) sum += hat(v - y) * hat(u - k) * x.at(n, c, y, k);
    return sum;
  });
}

/// Length of [a, b) inside pixel k.
double covered(double a, double b, int k) {
  return std::max(0.0, std::min(b, k + 1.0) - std::max(a, static_cast<double>(k)));
}

Tensor area(const Tensor& x, int h, int w) {
  const Shape& s = x.shape;
  const double sy = static_cast<double>(s.h) / h, sx = static_cast<double>(s.w) / w;
  return over(s, h, w, [&](int n, int c, int j, int i) {
    double sum = 0;
    for (int y = 0; y < s.h; ++y)
      for (int k = 0; k < s.w; ++k)
        sum += covered(j * sy, (j + 1) * sy, y) * covered(i * sx, (i + 1) * sx, k) * x.at(n, c, y, k);
    return sum / (sy * sx);
  });
}

struct Sizes {
  Shape from;
  int h, w;
  std::string text() const { return fmt::format("{}_to_{}x{}", from.text(), h, w); }
};

const std::vector<Sizes> kSizes{{{2, 2, 5, 7}, 10, 14},  {{1, 2, 7, 9}, 4, 3},   {{2, 1, 3, 20}, 3, 41},
                                {{1, 2, 1, 6}, 4, 1},    {{1, 1, 6, 1}, 1, 5},   {{1, 1, 4, 5}, 8, 3},
                                {{1, 2, 10, 7}, 20, 15}, {{1, 2, 3, 4}, 17, 23}, {{1, 1, 4, 5}, 8, 2},
                                {{1, 1, 4, 20}, 8, 9},   {{1, 1, 2, 5}, 3, 12}};

}  // namespace

OP_CASES(resize) {
  std::vector<OpCase> cases;
  for (const Sizes& z : kSizes) {
    const Tensors inputs{{"x", random_tensor(z.from, 1)}};
    for (const auto& [label, a] : {std::pair{"bilinear_", Aligned::Corners}, std::pair{"centres_", Aligned::Centres}})
      cases.push_back(
          {.stem = "resize",
           .label = label + z.text(),
           .kernels = {"resize_bilinear", "resize_bilinear_adjoint"},
           .inputs = inputs,
           .build = [z, aligned = a](
                        Graph&,
                        const Values& v) { return std::vector<Value>{resize_bilinear(v.at("x"), z.h, z.w, aligned)}; },
           .reference = [z, aligned = a](
                            const Tensors& t) { return std::vector<Tensor>{bilinear(t.at("x"), z.h, z.w, aligned)}; },
           .roundings = 8,
           .differentiate = {"x"}});
    cases.push_back(
        {.stem = "resize",
         .label = "area_" + z.text(),
         .kernels = {"resize_area"},
         .inputs = inputs,
         .build = [z](Graph&, const Values& v) { return std::vector<Value>{resize_area(v.at("x"), z.h, z.w)}; },
         .reference = [z](const Tensors& t) { return std::vector<Tensor>{area(t.at("x"), z.h, z.w)}; },
         // Ends of a box round at epsilon times the input's length, against lengths of a few pixels.
         .roundings = 24,
         .no_gradient = "prepares pictures; nothing is trained through it"});
    cases.push_back(
        {.stem = "resize",
         .label = "nearest_" + z.text(),
         .kernels = {"resize_nearest"},
         .inputs = inputs,
         .build = [z](Graph&, const Values& v) { return std::vector<Value>{resize_nearest(v.at("x"), z.h, z.w)}; },
         .reference =
             [z](const Tensors& t) {
               const Tensor& x = t.at("x");
               return std::vector<Tensor>{over(x.shape, z.h, z.w, [&](int n, int c, int j, int i) {
                 return x.at(n, c, static_cast<int>((j + 0.5) * x.shape.h / z.h),
                             static_cast<int>((i + 0.5) * x.shape.w / z.w));
               })};
             },
         .roundings = 0,
         .no_gradient = "prepares targets and masks"});
  }
  return cases;
}

}  // namespace clerestory
