// Reshape and detach, as views and copied.
#include "host/ops/tensor/reshape.hpp"

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

constexpr double kExact = 0;  // copies of numbers

}  // namespace

OP_CASES(reshape) {
  OpCase c{.stem = "reshape",
           .label = "regroups_the_batch",
           .kernels = {"reshape_copy"},
           .inputs = {{"x", random_tensor({2, 6, 3, 5}, 6)}},
           .build =
               [](Graph&, const Values& v) {
                 return std::vector<Value>{reshape(v.at("x"), {3, 4, 5, 3}), detach(v.at("x"))};
               },
           .reference =
               [](const Tensors& t) {
                 return std::vector<Tensor>{Tensor({3, 4, 5, 3}, t.at("x").real), t.at("x")};
               },
           .roundings = kExact,
           .no_gradient = "half of it is detached: see gradient_passes"};
  OpCase passes = c;
  passes.label = "gradient_passes", passes.no_gradient.clear(), passes.differentiate = {"x"};
  passes.build = [](Graph&, const Values& v) { return std::vector<Value>{reshape(v.at("x"), {3, 4, 5, 3})}; };
  passes.reference = [](const Tensors& t) { return std::vector<Tensor>{Tensor({3, 4, 5, 3}, t.at("x").real)}; };
  return {c, passes};
}

}  // namespace clerestory
