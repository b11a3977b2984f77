#include "host/ops/nn/pool.hpp"

#include <limits>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

Tensor average(const Tensor& x) {
  Tensor y({x.shape.n, x.shape.c, x.shape.h / 2, x.shape.w / 2});
  for (int n = 0; n < y.shape.n; ++n)
    for (int c = 0; c < y.shape.c; ++c)
      for (int j = 0; j < y.shape.h; ++j)
        for (int i = 0; i < y.shape.w; ++i)
          for (int k = 0; k < 4; ++k) y.at(n, c, j, i) += 0.25 * x.at(n, c, 2 * j + k / 2, 2 * i + k % 2);
  return y;
}

Tensor maximum(const Tensor& x, const MaxPoolSpec& spec) {
  const Shape& s = x.shape;
  const auto inside = [&](int k) { return k >= 0 && k < spec.window; };
  const auto pooled = [&](int n) { return (n + 2 * spec.pad - spec.window) / 2 + 1; };
  Tensor y({s.n, s.c, pooled(s.h), pooled(s.w)}, -std::numeric_limits<double>::infinity());
  for (int n = 0; n < s.n; ++n)
    for (int c = 0; c < s.c; ++c)
      for (int j = 0; j < s.h; ++j)
        for (int i = 0; i < s.w; ++i)
          for (int v = 0; v < y.shape.h; ++v)
            for (int u = 0; u < y.shape.w; ++u)
              if (inside(j - 2 * v + spec.pad) && inside(i - 2 * u + spec.pad))
                y.at(n, c, v, u) = std::max(y.at(n, c, v, u), x.at(n, c, j, i));
  return y;
}

OP_CASES(pool) {
  std::vector<OpCase> cases;
  for (const Shape& s : {Shape{2, 3, 6, 8}, Shape{2, 2, 7, 37}, Shape{1, 2, 5, 101}, Shape{1, 1, 2, 3}}) {
    cases.push_back({.stem = "pool",
                     .label = "average_" + s.text(),
                     .kernels = {"average_pool", "average_pool_adjoint"},
                     .inputs = {{"x", random_tensor(s, 1)}},
                     .build = [](Graph&, const Values& v) { return std::vector<Value>{average_pool(v.at("x"))}; },
                     .reference = [](const Tensors& t) { return std::vector<Tensor>{average(t.at("x"))}; },
                     .roundings = 4,
                     .differentiate = {"x"}});
    for (const MaxPoolSpec& spec : {MaxPoolSpec{}, MaxPoolSpec{.window = 2, .pad = 0}})
      cases.push_back(
          {.stem = "pool",
           .label = fmt::format("maximum_{}_{}", spec.window, s.text()),
           .kernels = {"max_pool", "max_pool_adjoint"},
           .inputs = {{"x", random_tensor(s, 2)}},
           .build = [spec](Graph&, const Values& v) { return std::vector<Value>{max_pool(v.at("x"), spec)}; },
           .reference = [spec](const Tensors& t) { return std::vector<Tensor>{maximum(t.at("x"), spec)}; },
           .roundings = 0,
           .differentiate = {"x"},
           .gradient_roundings = 4});
  }
  return cases;
}

}  // namespace
}  // namespace clerestory
