#include "host/ops/tensor/reciprocal.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

struct Named {
  const char* name;
  Value (*op)(Value);
  double (*value)(double);
  double low;  // of random inputs
};

const std::vector<Named> kFunctions{{"whole", reciprocal, [](double x) { return 1 / x; }, -4},
                                    {"root", reciprocal_root, [](double x) { return 1 / std::sqrt(x); }, 0.1}};

Tensor mapped(const Tensor& x, double (*f)(double)) {
  Tensor y(x.shape);
  for (std::size_t i = 0; i < y.real.size(); ++i) y.real[i] = f(x.real[i]);
  return y;
}

/// Random numbers at least 0.1 from 0, of either sign where `low` is below 0.
Tensor away_from_zero(const Shape& shape, double low) {
  Tensor x = random_tensor(shape, 1, low, 4);
  for (double& v : x.real) v += v < 0 ? -0.1 : 0.1;
  return x;
}

OpCase case_of(const Named& f, const std::string& label, Tensor x) {
  return {.stem = "reciprocal",
          .label = fmt::format("{}_{}", f.name, label),
          .kernels = {"reciprocal"},
          .inputs = {{"x", std::move(x)}},
          .build = [f](Graph&, const Values& v) { return std::vector<Value>{f.op(v.at("x"))}; },
          .reference = [f](const Tensors& t) { return std::vector<Tensor>{mapped(t.at("x"), f.value)}; },
          .roundings = 6};  // OpenCL's division 2.5 ulp, sqrt 3
}

}  // namespace

OP_CASES(reciprocal) {
  std::vector<OpCase> cases;
  for (const Named& f : kFunctions) {
    OpCase some = case_of(f, "some", away_from_zero({2, 3, 5, 7}, f.low));
    some.kernels = {"reciprocal", "reciprocal_adjoint"}, some.differentiate = {"x"};
    some.step = 1e-6, some.gradient_tolerance = 1e-7;  // f''' reaches 6 / 0.1^4
    cases.push_back(some);
    // Rows of several blocks, and no whole number of lanes.
    OpCase blocks = case_of(f, "blocks", away_from_zero({2, 3, 97, 101}, f.low));
    blocks.no_gradient = "those of `some`";
    cases.push_back(blocks);
    // From where a result is near float's largest number to where it is near its smallest normal one, each by itself:
    // errors count against the largest result of a case.
    int end = 0;
    for (const double x : {0x1p-125, 0x1p-60, 0x1p60, 0x1p125}) {
      cases.push_back(case_of(f, fmt::format("end{}", end++), Tensor({1, 1, 1, 1}, std::vector<double>{x})));
      cases.back().no_gradient = "the squares of such results are no floats";
    }
  }
  return cases;
}

}  // namespace clerestory
