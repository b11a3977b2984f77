// Elementwise sums and products with broadcasting, reductions, and the sum in which gradients meet.
#include <cmath>

#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

double broadcast(const Tensor& b, int n, int c, int y, int x) {
  return b.at(b.shape.n > 1 ? n : 0, b.shape.c > 1 ? c : 0, b.shape.plane() > 1 ? y : 0, b.shape.plane() > 1 ? x : 0);
}

template <class F>
Tensor each(const Tensor& a, const Tensor& b, F f) {
  Tensor out(a.shape);
  for (int n = 0; n < a.shape.n; ++n)
    for (int c = 0; c < a.shape.c; ++c)
      for (int y = 0; y < a.shape.h; ++y)
        for (int x = 0; x < a.shape.w; ++x) out.at(n, c, y, x) = f(a.at(n, c, y, x), broadcast(b, n, c, y, x));
  return out;
}

Tensor summed(const Tensor& x, const Shape& to, double factor) {
  Tensor out(to);
  for (int n = 0; n < x.shape.n; ++n)
    for (int c = 0; c < x.shape.c; ++c)
      for (int y = 0; y < x.shape.h; ++y)
        for (int i = 0; i < x.shape.w; ++i)
          out.at(to.n > 1 ? n : 0, to.c > 1 ? c : 0, to.plane() > 1 ? y : 0, to.plane() > 1 ? i : 0) += factor * x.at(n, c, y, i);
  return out;
}

constexpr Shape kFull{2, 3, 5, 7};
const std::vector<Shape> kBroadcasts{kFull, {1, 3, 5, 7}, {2, 1, 5, 7}, {2, 3, 1, 1}, {1, 3, 1, 1}, {2, 1, 1, 1}, {1, 1, 5, 7}, {1, 1, 1, 1}};

}  // namespace

OP_CASES(elementwise) {
  std::vector<OpCase> cases;
  for (const Shape& b : kBroadcasts) {
    const Tensors inputs{{"a", random_tensor(kFull, 1)}, {"b", random_tensor(b, 2)}};
    // Gradients of b are sums of up to 210 products.
    const double gradient_roundings = 30;
    cases.push_back({.stem = "elementwise",
                     .label = "add_" + b.text(),
                     .kernels = {"add_scaled"},
                     .inputs = inputs,
                     .build = [](Graph&, const Values& v) { return std::vector<Value>{add(v.at("a"), v.at("b"), -0.75)}; },
                     .reference = [](const Tensors& t) {
                       return std::vector<Tensor>{each(t.at("a"), t.at("b"), [](double x, double y) { return x - 0.75 * y; })};
                     },
                     .roundings = 2,
                     .differentiate = {"a", "b"},
                     .gradient_roundings = gradient_roundings});
    cases.push_back({.stem = "elementwise",
                     .label = "multiply_" + b.text(),
                     .kernels = {"multiply"},
                     .inputs = inputs,
                     .build = [](Graph&, const Values& v) { return std::vector<Value>{multiply(v.at("a"), v.at("b"))}; },
                     .reference = [](const Tensors& t) {
                       return std::vector<Tensor>{each(t.at("a"), t.at("b"), [](double x, double y) { return x * y; })};
                     },
                     .roundings = 1,
                     .differentiate = {"a", "b"},
                     .gradient_roundings = gradient_roundings});
    cases.push_back({.stem = "elementwise",
                     .label = "expand_" + b.text(),
                     .kernels = {"expand"},
                     .inputs = {{"b", random_tensor(b, 2)}},
                     .build = [](Graph&, const Values& v) { return std::vector<Value>{expand(v.at("b"), kFull, 0.3)}; },
                     .reference = [](const Tensors& t) {
                       return std::vector<Tensor>{each(Tensor(kFull), t.at("b"), [](double, double y) { return 0.3 * y; })};
                     },
                     .roundings = 2,
                     .differentiate = {"b"},
                     .gradient_roundings = gradient_roundings});
  }
  // More than one block of a row, and no whole number of lanes.
  cases.push_back({.stem = "elementwise",
                   .label = "affine",
                   .kernels = {"affine"},
                   .inputs = {{"a", random_tensor({2, 2, 97, 101}, 3)}},
                   .build = [](Graph&, const Values& v) { return std::vector<Value>{affine(v.at("a"), 1.7, -0.2)}; },
                   .reference = [](const Tensors& t) {
                     return std::vector<Tensor>{each(t.at("a"), Tensor({1, 1, 1, 1}), [](double x, double) { return 1.7 * x - 0.2; })};
                   },
                   .roundings = 3,
                   .differentiate = {"a"},
                   .gradient_roundings = 2,
                   .differences = 10});
  return cases;
}

OP_CASES(reduce) {
  std::vector<OpCase> cases;
  for (const Shape& to : kBroadcasts) {
    if (to == kFull) continue;
    std::vector<std::string> kernels;
    if (to.plane() == 1) kernels.push_back("sum_plane");
    if (to.c == 1) kernels.push_back("sum_channels");
    if (to.n == 1) kernels.push_back("sum_batch");
    cases.push_back({.stem = "reduce",
                     .label = "to_" + to.text(),
                     .kernels = kernels,
                     .inputs = {{"x", random_tensor(kFull, 4)}},
                     .build = [to](Graph&, const Values& v) { return std::vector<Value>{sum_to(v.at("x"), to, 0.4)}; },
                     .reference = [to](const Tensors& t) { return std::vector<Tensor>{summed(t.at("x"), to, 0.4)}; },
                     .roundings = 12,
                     .magnitude = 0.4 * std::sqrt(static_cast<double>(kFull.count())),
                     .differentiate = {"x"}});
  }
  cases.push_back({.stem = "reduce",
                   .label = "means",
                   .kernels = {"sum_plane", "sum_channels", "sum_batch"},
                   .inputs = {{"x", random_tensor({3, 2, 33, 41}, 5)}},
                   .build = [](Graph&, const Values& v) {
                     return std::vector<Value>{mean(v.at("x")), sum(v.at("x")), plane_mean(v.at("x"))};
                   },
                   .reference = [](const Tensors& t) {
                     const Tensor& x = t.at("x");
                     const double count = static_cast<double>(x.shape.count());
                     return std::vector<Tensor>{summed(x, {}, 1 / count), summed(x, {}, 1),
                                                summed(x, {3, 2, 1, 1}, 1.0 / static_cast<double>(x.shape.plane()))};
                   },
                   // 85 additions per lane of running sums no larger than 85; the sum is the largest of the outputs.
                   .roundings = 12,
                   .magnitude = 90,
                   .differentiate = {"x"},
                   .differences = 12});
  return cases;
}

OP_CASES(accumulate) {
  return {{.stem = "accumulate",
           .label = "two",
           .kernels = {"accumulate"},
           .inputs = {{"a", random_tensor(kFull, 6)}, {"b", random_tensor(kFull, 7)}},
           .build = [](Graph&, const Values& v) { return std::vector<Value>{accumulate(v.at("a"), v.at("b"))}; },
           .reference = [](const Tensors& t) {
             return std::vector<Tensor>{each(t.at("a"), t.at("b"), [](double x, double y) { return x + y; })};
           },
           .roundings = 1,
           .differentiate = {"a", "b"}}};
}

}  // namespace clerestory
