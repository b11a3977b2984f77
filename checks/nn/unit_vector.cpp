#include "host/ops/nn/unit_vector.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {

OP_CASES(unit_vector) {
  OpCase usual{.stem = "unit_vector",
               .label = "usual",
               .kernels = {"unit_vector", "unit_vector_adjoint"},
               .inputs = {{"t", random_tensor({2, 3, 5, 7}, 1)}},
               .build = [](Graph&, const Values& v) { return std::vector<Value>{unit_vector(v.at("t"))}; },
               .reference =
                   [](const Tensors& in) {
                     const Tensor& t = in.at("t");
                     Tensor out(t.shape);
                     for (int n = 0; n < t.shape.n; ++n)
                       for (int y = 0; y < t.shape.h; ++y)
                         for (int x = 0; x < t.shape.w; ++x) {
                           double length = 0;
                           for (int c = 0; c < 3; ++c) length += t.at(n, c, y, x) * t.at(n, c, y, x);
                           for (int c = 0; c < 3; ++c)
                             out.at(n, c, y, x) = t.at(n, c, y, x) / std::max(std::sqrt(length), 1e-6);
                         }
                     return std::vector<Tensor>{out};
                   },
               .roundings = 8,
               .differentiate = {"t"},
               .gradient_roundings = 200};  // short vectors: the gradient's projection cancels against 1 / |t|
  OpCase tiny = usual;                      // shorter than 1e-6: linear there
  tiny.label = "tiny", tiny.inputs["t"] = random_tensor({1, 3, 4, 4}, 2, -5e-7, 5e-7), tiny.step = 1e-9;
  OpCase zero = usual;
  zero.label = "zero", zero.inputs["t"] = Tensor({1, 3, 2, 2}), zero.step = 1e-9, zero.magnitude = 1;
  return {usual, tiny, zero};
}

}  // namespace clerestory
