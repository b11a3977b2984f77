#include "host/ops/nn/adam.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/ops/op_check.hpp"

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

// More parameters than one launch takes, of unlike sizes: each moves as it does alone.
TEST(Adam, ManyParametersMoveAsEachAlone) {
  const std::vector<Shape> shapes{{3, 5, 1, 1},    {1, 7, 1, 1},  {40, 30, 3, 3}, {1, 1, 1, 1},
                                  {2, 2, 2, 2},    {1, 16, 1, 1}, {8, 4, 3, 3},   {1, 9, 1, 1},
                                  {100, 90, 1, 1}, {1, 3, 1, 1},  {5, 5, 1, 1}};
  const auto name = [](std::size_t i) { return fmt::format("p{}", i); };
  const auto moved = [&](const std::vector<std::size_t>& which) {
    Graph graph;
    const Device device = test_device();
    const auto states = std::make_shared<States>(device);
    std::vector<Value> parameters, gradients;
    for (const std::size_t i : which) {
      parameters.push_back(graph.state(name(i), shapes[i], Init::constant(1)));
      gradients.push_back(graph.constant(random_tensor(shapes[i], i)));
    }
    adam(parameters, gradients, graph.fill({}, 1e-2), graph.fill({}, 1), {});
    states->initialise(graph, 1);
    Executor(compile(graph, {}, device, {}, true), states).run();
    std::map<std::string, Tensor> after;
    for (const std::string& s : states->names()) after[s] = states->get(s);
    return after;
  };
  std::vector<std::size_t> all(shapes.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const auto together = moved(all);
  EXPECT_EQ(together.size(), 3 * shapes.size());
  for (const std::size_t i : all)
    for (const auto& [state, tensor] : moved({i})) {
      EXPECT_EQ(together.at(state).real, tensor.real) << state;
      EXPECT_NE(tensor.real, std::vector<double>(tensor.real.size(), state == name(i) ? 1.0 : 0.0)) << state;
    }
}

}  // namespace

}  // namespace clerestory
