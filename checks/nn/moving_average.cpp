#include "host/ops/nn/moving_average.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

// More parameters than one launch takes, of unlike sizes.
const std::vector<Shape> kShapes{{3, 5, 1, 1},  {1, 7, 1, 1}, {40, 30, 3, 3}, {1, 1, 1, 1},  {2, 2, 2, 2},
                                 {1, 16, 1, 1}, {8, 4, 3, 3}, {1, 9, 1, 1},   {90, 90, 1, 1}};

std::string name_of(std::size_t i) { return fmt::format("p{}", i); }

OpCase average_case(const std::string& label, double step, double keep) {
  OpCase c{.stem = "moving_average",
           .label = label,
           .kernels = {"moving_average"},
           .inputs = {{"step", Tensor({}, step)}},
           .build =
               [keep](Graph& g, const Values& v) {
                 std::vector<Value> parameters;
                 for (std::size_t i = 0; i < kShapes.size(); ++i)
                   parameters.push_back(g.state(name_of(i), kShapes[i], Init::constant(0)));
                 moving_average(parameters, v.at("step"), keep);
                 return std::vector<Value>{};
               },
           .reference =
               [keep](const Tensors& t) {
                 const double steps = t.at("step").real[0], kept = std::min(keep, (1 + steps) / (10 + steps));
                 std::vector<Tensor> after;  // by name: averages, then the parameters as they were
                 for (std::size_t i = 0; i < kShapes.size(); ++i) {
                   const std::string name = name_of(i);
                   Tensor a = t.at(average_name(name));
                   for (std::size_t k = 0; k < a.real.size(); ++k)
                     a.real[k] = kept * a.real[k] + (1 - kept) * t.at(name).real[k];
                   after.push_back(a);
                 }
                 for (std::size_t i = 0; i < kShapes.size(); ++i) after.push_back(t.at(name_of(i)));
                 return after;
               },
           .roundings = 4,
           .no_gradient = "an update of states"};
  for (std::size_t i = 0; i < kShapes.size(); ++i) {
    const std::string name = name_of(i);
    c.states[name] = random_tensor(kShapes[i], 2 * i);
    c.states[average_name(name)] = random_tensor(kShapes[i], 2 * i + 1);
  }
  return c;
}

OP_CASES(moving_average) {
  return {average_case("first_step", 1, 0.999), average_case("early", 50, 0.999), average_case("later", 1e5, 0.999),
          average_case("kept_nothing", 10, 0)};
}

}  // namespace
}  // namespace clerestory
