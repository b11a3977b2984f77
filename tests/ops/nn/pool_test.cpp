#include "host/ops/nn/pool.hpp"

#include <limits>

#include "tests/ops/op_check.hpp"

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

Tensor maximum(const Tensor& x) {
  const Shape& s = x.shape;
  Tensor y({s.n, s.c, (s.h - 1) / 2 + 1, (s.w - 1) / 2 + 1}, -std::numeric_limits<double>::infinity());
  for (int n = 0; n < s.n; ++n)
    for (int c = 0; c < s.c; ++c)
      for (int j = 0; j < s.h; ++j)
        for (int i = 0; i < s.w; ++i)
          for (int v = 0; v < y.shape.h; ++v)
            for (int u = 0; u < y.shape.w; ++u)
              if (std::abs(2 * v - j) <= 1 && std::abs(2 * u - i) <= 1) y.at(n, c, v, u) = std::max(y.at(n, c, v, u), x.at(n, c, j, i));
  return y;
}

}  // namespace

OP_CASES(pool) {
  std::vector<OpCase> cases;
  for (const Shape& s : {Shape{2, 3, 6, 8}, Shape{2, 2, 7, 37}, Shape{1, 1, 2, 3}}) {
    cases.push_back({.stem = "pool",
                     .label = "average_" + s.text(),
                     .kernels = {"average_pool", "average_pool_adjoint"},
                     .inputs = {{"x", random_tensor(s, 1)}},
                     .build = [](Graph&, const Values& v) { return std::vector<Value>{average_pool(v.at("x"))}; },
                     .reference = [](const Tensors& t) { return std::vector<Tensor>{average(t.at("x"))}; },
                     .roundings = 4,
                     .differentiate = {"x"}});
    cases.push_back({.stem = "pool",
                     .label = "maximum_" + s.text(),
                     .kernels = {"max_pool", "max_pool_adjoint"},
                     .inputs = {{"x", random_tensor(s, 2)}},
                     .build = [](Graph&, const Values& v) { return std::vector<Value>{max_pool(v.at("x"))}; },
                     .reference = [](const Tensors& t) { return std::vector<Tensor>{maximum(t.at("x"))}; },
                     .roundings = 0,
                     .differentiate = {"x"},
                     .gradient_roundings = 4});
  }
  return cases;
}

}  // namespace clerestory
