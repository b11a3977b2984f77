#include "host/ops/nn/adam.hpp"

#include <fmt/format.h>

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

OpCase adam_case(const std::string& label, Shape shape, double step) {
  return {.stem = "adam",
          .label = label,
          .kernels = {"adam_schedule", "adam_update"},
          .inputs = {{"gradient", random_tensor(shape, 1)}, {"rate", Tensor({}, 5e-4)}, {"step", Tensor({}, step)}},
          .states = {{"adam.m.p", random_tensor(shape, 2)},
                     {"adam.v.p", random_tensor(shape, 3, 0, 1)},
                     {"p", random_tensor(shape, 4)}},
          .build =
              [shape](Graph& g, const Values& v) {
                const std::vector<Value> p{g.state("p", shape, Init::constant(0))}, gradient{v.at("gradient")};
                adam(p, gradient, v.at("rate"), v.at("step"), {.beta1 = 0.5, .beta2 = 0.999, .epsilon = 1e-8});
                return std::vector<Value>{};
              },
          .reference =
              [](const Tensors& t) {
                Tensor m = t.at("adam.m.p"), v = t.at("adam.v.p"), p = t.at("p");
                const double steps = t.at("step").real[0], rate = t.at("rate").real[0];
                for (std::size_t i = 0; i < p.real.size(); ++i) {
                  const double g = t.at("gradient").real[i];
                  m.real[i] = 0.5 * m.real[i] + 0.5 * g;
                  v.real[i] = 0.999 * v.real[i] + 0.001 * g * g;
                  const double unbiased_m = m.real[i] / (1 - std::pow(0.5, steps)),
                               unbiased_v = v.real[i] / (1 - std::pow(0.999, steps));
                  p.real[i] -= rate * unbiased_m / (std::sqrt(unbiased_v) + 1e-8);
                }
                return std::vector<Tensor>{m, v, p};
              },
          .roundings = 4,
          .no_gradient = "an update of states"};
}

OP_CASES(adam) {
  return {adam_case("first_step", {5, 3, 3, 3}, 1), adam_case("later", {1, 7, 1, 1}, 1000),
          adam_case("blocks", {129, 65, 1, 1}, 10)};
}

}  // namespace
}  // namespace clerestory
