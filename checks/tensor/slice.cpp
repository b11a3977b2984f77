// Slices of channels, as views and copied.
#include "host/ops/tensor/slice.hpp"

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

constexpr double kExact = 0;  // copies of numbers

Tensor part(const Tensor& t, int first, int count) {
  Tensor out({t.shape.n, count, t.shape.h, t.shape.w});
  for (int n = 0; n < t.shape.n; ++n)
    for (int c = 0; c < count; ++c)
      for (int y = 0; y < t.shape.h; ++y)
        for (int x = 0; x < t.shape.w; ++x) out.at(n, c, y, x) = t.at(n, first + c, y, x);
  return out;
}

}  // namespace

OP_CASES(slice) {
  std::vector<OpCase> cases;
  for (const int first : {0, 2, 4})
    cases.push_back(
        {.stem = "slice",
         .label = "from_" + std::to_string(first),
         .kernels = {"slice_take", "slice_adjoint"},
         .inputs = {{"x", random_tensor({2, 6, 3, 5}, 5)}},
         .build = [first](Graph&, const Values& v) { return std::vector<Value>{slice(v.at("x"), first, 2)}; },
         .reference = [first](const Tensors& t) { return std::vector<Tensor>{part(t.at("x"), first, 2)}; },
         .roundings = kExact,
         .differentiate = {"x"}});
  OpCase blocks = cases[1];  // a run of several blocks, and no whole number of lanes
  blocks.label = "blocks", blocks.inputs = {{"x", random_tensor({2, 6, 97, 101}, 5)}}, blocks.differences = 10;
  cases.push_back(blocks);
  return cases;
}

}  // namespace clerestory
