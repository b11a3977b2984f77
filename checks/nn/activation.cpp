#include "host/ops/nn/activation.hpp"

#include <cmath>
#include <numbers>

#include "checks/op_case.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory {
namespace {

struct Named {
  Function function;
  const char* name;
  double (*value)(double);
  double low, high;  // of random inputs
};

double sigmoid(double x) { return 1 / (1 + std::exp(-x)); }
/// In more digits than double has: near a right angle a rounding counts 636 times.
double tangent(double x) {
  return static_cast<double>(std::tan(0.999L * std::numbers::pi_v<long double> / 2 * static_cast<long double>(x)));
}

const std::vector<Named> kFunctions{
    {Function::Relu, "relu", [](double x) { return std::max(x, 0.0); }, -2, 2},
    {Function::Unit, "unit", [](double x) { return std::clamp(1.01 * sigmoid(x), 0.0, 1.0); }, -7, 7},
    {Function::SignedUnit, "signed_unit", [](double x) { return std::clamp(1.01 * std::tanh(x), -1.0, 1.0); }, -4, 4},
    {Function::Exp, "exp", [](double x) { return std::exp(x); }, -3, 3},
    {Function::Log, "log", [](double x) { return std::log(x); }, 0.1, 8},
    {Function::Softplus, "softplus",
     [](double x) { return x > 0 ? x + std::log1p(std::exp(-x)) : std::log1p(std::exp(x)); }, -20, 20},
    {Function::Square, "square", [](double x) { return x * x; }, -2, 2},
    {Function::Log1p, "log1p", [](double x) { return std::log1p(x); }, 0, 5},
    {Function::Tanh, "tanh", [](double x) { return std::tanh(x); }, -4, 4},
    {Function::Tangent, "tangent", tangent, 0, 0.6},
    {Function::Relu6, "relu6", [](double x) { return std::clamp(x, 0.0, 6.0); }, -4, 10},
};

Tensor mapped(const Tensor& x, double (*f)(double)) {
  Tensor y(x.shape);
  for (std::size_t i = 0; i < y.real.size(); ++i) y.real[i] = f(x.real[i]);
  return y;
}

}  // namespace

OP_CASES(activation) {
  std::vector<OpCase> cases;
  for (const Named& f : kFunctions) {
    OpCase c{.stem = "activation",
             .label = f.name,
             .kernels = {"activate", "activate_adjoint"},
             .inputs = {{"x", random_tensor({2, 3, 5, 7}, 1, f.low, f.high)}},
             .build = [f](Graph&, const Values& v) { return std::vector<Value>{activate(v.at("x"), f.function)}; },
             .reference = [f](const Tensors& t) { return std::vector<Tensor>{mapped(t.at("x"), f.value)}; },
             .roundings = 12,  // OpenCL's exp, log 3, tanh 5 ulp and what follows
             .differentiate = {"x"},
             .gradient_roundings = 24};
    c.step = 1e-4;
    cases.push_back(c);
  }
  OpCase blocks = cases.front();  // rows of several blocks, and no whole number of lanes
  blocks.label = "blocks", blocks.inputs = {{"x", random_tensor({2, 3, 97, 101}, 1, -2, 2)}}, blocks.differences = 10;
  cases.push_back(blocks);
  // Far ends, and both sides of the points where the clamps set in (sigmoid = 1/1.01 at ln 100, tanh at 2.65).
  const std::vector<double> ends{0,   -0.0, 1e-30, -1e-30, 90,   -90,   700, -700,
                                 4.6, 4.61, -4.61, 2.64,   2.66, -2.66, 20,  -20};
  for (const Named& f : kFunctions) {
    if (f.function == Function::Exp || f.function == Function::Log || f.function == Function::Log1p ||
        f.function == Function::Square || f.function == Function::Tangent)
      continue;
    cases.push_back(
        {.stem = "activation",
         .label = std::string(f.name) + "_ends",
         .kernels = {"activate"},
         .inputs = {{"x", Tensor({1, 1, 2, 8}, ends)}},
         .build = [f](Graph&, const Values& v) { return std::vector<Value>{activate(v.at("x"), f.function)}; },
         .reference = [f](const Tensors& t) { return std::vector<Tensor>{mapped(t.at("x"), f.value)}; },
         .roundings = 12,
         .no_gradient = "the points lie on kinks; the slopes are tested between them"});
  }
  // Up to where the tangent ends, each value and slope in parts of itself: beside one over them.
  const std::vector<double> points{1,    0.99999994, 0.9999, 0.999,      0.99, 0.98, 0.95,  0.9,
                                   0.75, 0.50000006, 0.5,    0.49999997, 0.25, 1e-3, 1e-10, 1e-30};
  const Tensor steep({1, 1, 2, 8}, points);
  const Tensor one_over = mapped(steep, [](double x) {
    return static_cast<double>(static_cast<float>(1 / tangent(static_cast<double>(static_cast<float>(x)))));
  });
  cases.push_back({.stem = "activation",
                   .label = "tangent_ends",
                   .kernels = {"activate"},
                   .inputs = {{"x", steep}, {"one_over", one_over}},
                   .build =
                       [](Graph&, const Values& v) {
                         const Value y = activate(v.at("x"), Function::Tangent);
                         return std::vector<Value>{multiply(y, v.at("one_over"))};
                       },
                   .reference =
                       [](const Tensors& t) {
                         Tensor y = mapped(t.at("x"), tangent);
                         for (std::size_t i = 0; i < y.real.size(); ++i) y.real[i] *= t.at("one_over").real[i];
                         return std::vector<Tensor>{y};
                       },
                   .roundings = 12,
                   .no_gradient = "slopes are those of tangent_steep"});
  OpCase steepest{.stem = "activation", .label = "tangent_steep", .kernels = {"activate", "activate_adjoint"}};
  steepest.inputs = {{"x", random_tensor({1, 1, 2, 20}, 1, 0.98, 1)}};
  steepest.build = [](Graph&, const Values& v) { return std::vector<Value>{activate(v.at("x"), Function::Tangent)}; };
  steepest.reference = [](const Tensors& t) { return std::vector<Tensor>{mapped(t.at("x"), tangent)}; };
  steepest.roundings = 12, steepest.gradient_roundings = 24;
  steepest.differentiate = {"x"}, steepest.step = 1e-7;
  cases.push_back(steepest);
  return cases;
}

}  // namespace clerestory
