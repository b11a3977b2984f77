// Padding by replication.
#include "host/ops/tensor/pad.hpp"

#include <algorithm>

#include "checks/op_case.hpp"
#include "checks/tensor/shapes.hpp"

namespace clerestory {

OP_CASES(pad) {
  std::vector<OpCase> cases;
  for (const Padding& p : {Padding{1, 1, 1, 1}, Padding{0, 3, 0, 2}, Padding{2, 0, 3, 1}})
    for (const Shape& s : {Shape{2, 2, 3, 5}, Shape{1, 2, 1, 1}})
      cases.push_back(
          {.stem = "pad",
           .label = fmt::format("{}_{}_{}_{}_{}", s.text(), p.top, p.bottom, p.left, p.right),
           .kernels = {"pad_replicate", "pad_replicate_adjoint"},
           .inputs = {{"x", random_tensor(s, 1)}},
           .build = [p](Graph&, const Values& v) { return std::vector<Value>{pad_replicate(v.at("x"), p)}; },
           .reference =
               [p](const Tensors& t) {
                 const Tensor& x = t.at("x");
                 const Shape& in = x.shape;
                 return std::vector<Tensor>{
                     over(in, in.h + p.top + p.bottom, in.w + p.left + p.right, [&](int n, int c, int j, int i) {
                       return x.at(n, c, std::clamp(j - p.top, 0, in.h - 1), std::clamp(i - p.left, 0, in.w - 1));
                     })};
               },
           .roundings = 0,
           .differentiate = {"x"},
           .gradient_roundings = 20});
  return cases;
}

}  // namespace clerestory
