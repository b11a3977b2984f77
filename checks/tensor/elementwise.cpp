// Sums and products with broadcasting.
#include "host/ops/tensor/elementwise.hpp"

#include "checks/op_case.hpp"
#include "checks/tensor/shapes.hpp"

namespace clerestory {
namespace {

template <class F>
Tensor each(const Tensor& a, const Tensor& b, F f) {
  return over(a.shape, a.shape.h, a.shape.w,
              [&](int n, int c, int y, int x) { return f(a.at(n, c, y, x), broadcast(b, n, c, y, x)); });
}

}  // namespace

OP_CASES(elementwise) {
  std::vector<OpCase> cases;
  std::vector<std::pair<Shape, Shape>> shapes;
  for (const Shape& b : kBroadcasts) shapes.emplace_back(kFull, b);
  // More than one block of a row, and no whole number of lanes.
  shapes.emplace_back(Shape{2, 2, 97, 101}, Shape{1, 1, 97, 101});
  for (const auto& pair : shapes) {
    const Shape full = pair.first, b = pair.second;
    const Tensors inputs{{"a", random_tensor(full, 1)}, {"b", random_tensor(b, 2)}};
    // Gradients of b are sums of up to 210 products.
    const double gradient_roundings = 30;
    const int differences = full.count() > 1000 ? 10 : 150;
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
         .gradient_roundings = gradient_roundings,
         .differences = differences});
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
         .gradient_roundings = gradient_roundings,
         .differences = differences});
    cases.push_back(
        {.stem = "elementwise",
         .label = "expand_" + b.text(),
         .kernels = {"expand"},
         .inputs = {{"b", random_tensor(b, 2)}},
         .build = [full](Graph&, const Values& v) { return std::vector<Value>{expand(v.at("b"), full, 0.3)}; },
         .reference =
             [full](const Tensors& t) {
               return std::vector<Tensor>{each(Tensor(full), t.at("b"), [](double, double y) { return 0.3 * y; })};
             },
         .roundings = 2,
         .differentiate = {"b"},
         .gradient_roundings = gradient_roundings,
         .differences = differences});
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
