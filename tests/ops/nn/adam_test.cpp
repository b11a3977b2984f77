#include "host/ops/nn/adam.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numeric>

#include "checks/op_case.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

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
