// Sums and products with broadcasting.
#include "host/ops/tensor/elementwise.hpp"

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

constexpr Shape kFull{2, 3, 5, 7};
const std::vector<Shape> kBroadcasts{kFull,        {1, 3, 5, 7}, {2, 1, 5, 7}, {2, 3, 1, 1},
                                     {1, 3, 1, 1}, {2, 1, 1, 1}, {1, 1, 5, 7}, {1, 1, 1, 1}};

}  // namespace

OP_CASES(elementwise) {
  std::vector<OpCase> cases;
  for (const Shape& b : kBroadcasts) {
    const Tensors inputs{{"a", random_tensor(kFull, 1)}, {"b", random_tensor(b, 2)}};
    // Gradients of b are sums of up to 210 products.
    const double gradient_roundings = 30;
    cases.push_back(
        {.stem = "elementwise",
         .label = "add_" + b.text(),
         .kernels = {"add_scaled"},
         .inputs = inputs,
         .build = [](Graph&, const Values& v) { return std::vector<Value>{add(v.at("a"), v.at("b"), -0.75)}; },
         .reference =
             [](const Tensors& t) {
               return std::vector<Tensor>{each(t.at("a"), t.at("b"), [](double x, double y) { return x - 0.75 * y; })};
             },
         .roundings = 2,
         .differentiate = {"a", "b"},
         .gradient_roundings = gradient_roundings});
    cases.push_back(
        {.stem = "elementwise",
         .label = "multiply_" + b.text(),
         .kernels = {"multiply"},
         .inputs = inputs,
         .build = [](Graph&, const Values& v) { return std::vector<Value>{multiply(v.at("a"), v.at("b"))}; },
         .reference =
             [](const Tensors& t) {
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
                     .reference =
                         [](const Tensors& t) {
                           return std::vector<Tensor>{
                               each(Tensor(kFull), t.at("b"), [](double, double y) { return 0.3 * y; })};
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
                   .reference =
                       [](const Tensors& t) {
                         return std::vector<Tensor>{
                             each(t.at("a"), Tensor({1, 1, 1, 1}), [](double x, double) { return 1.7 * x - 0.2; })};
                       },
                   .roundings = 3,
                   .differentiate = {"a"},
                   .gradient_roundings = 2,
                   .differences = 10});
  return cases;
}

}  // namespace clerestory
