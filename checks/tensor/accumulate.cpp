// The sum in which gradients meet.
#include "checks/op_case.hpp"

namespace clerestory {

OP_CASES(accumulate) {
  return {{.stem = "accumulate",
           .label = "two",
           .kernels = {"accumulate"},
           .inputs = {{"a", random_tensor(Shape{2, 3, 5, 7}, 6)}, {"b", random_tensor(Shape{2, 3, 5, 7}, 7)}},
           .build = [](Graph&, const Values& v) { return std::vector<Value>{accumulate(v.at("a"), v.at("b"))}; },
           .reference =
               [](const Tensors& t) {
                 Tensor sum = t.at("a");
                 for (std::size_t i = 0; i < sum.real.size(); ++i) sum.real[i] += t.at("b").real[i];
                 return std::vector<Tensor>{sum};
               },
           .roundings = 1,
           .differentiate = {"a", "b"}}};
}

}  // namespace clerestory
