// Concatenation, written in place and copied.
#include "host/ops/tensor/concat.hpp"

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

constexpr double kExact = 0;  // copies of numbers

Tensor join(const std::vector<Tensor>& parts) {
  Shape s = parts[0].shape;
  s.c = 0;
  for (const Tensor& p : parts) s.c += p.shape.c;
  Tensor out(s);
  for (int n = 0; n < s.n; ++n)
    for (int c = 0; const Tensor& p : parts)
      for (int k = 0; k < p.shape.c; ++k, ++c)
        for (int y = 0; y < s.h; ++y)
          for (int x = 0; x < s.w; ++x) out.at(n, c, y, x) = p.at(n, k, y, x);
  return out;
}

}  // namespace

OP_CASES(concat) {
  std::vector<OpCase> cases;
  // One tensor twice: it cannot lie in two places at once.
  cases.push_back({.stem = "concat",
                   .label = "three_parts",
                   .kernels = {"concat_part", "slice_take"},
                   .inputs = {{"a", random_tensor({2, 3, 5, 7}, 1)}, {"b", random_tensor({2, 1, 5, 7}, 2)}},
                   .build =
                       [](Graph&, const Values& v) {
                         return std::vector<Value>{concat(std::vector<Value>{v.at("a"), v.at("b"), v.at("a")})};
                       },
                   .reference =
                       [](const Tensors& t) {
                         return std::vector<Tensor>{join({t.at("a"), t.at("b"), t.at("a")})};
                       },
                   .roundings = kExact,
                   .differentiate = {"a", "b"},
                   .gradient_roundings = 1});  // a's gradient is one sum
  // A chain, as in a dense block, longer than one block of the copy.
  cases.push_back({.stem = "concat",
                   .label = "chain",
                   .kernels = {"concat_part"},
                   .inputs = {{"a", random_tensor({2, 2, 70, 65}, 3)}, {"b", random_tensor({2, 1, 70, 65}, 4)}},
                   .build =
                       [](Graph&, const Values& v) {
                         const Value first = concat(std::vector<Value>{v.at("a"), v.at("b")});
                         return std::vector<Value>{concat(std::vector<Value>{first, v.at("b")})};
                       },
                   .reference =
                       [](const Tensors& t) {
                         return std::vector<Tensor>{join({t.at("a"), t.at("b"), t.at("b")})};
                       },
                   .roundings = kExact,
                   .differentiate = {"a", "b"},
                   .gradient_roundings = 1,
                   .differences = 20});
  return cases;
}

}  // namespace clerestory
