#include "checks/stability/stability_case.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "checks/op_run.hpp"
#include "host/graph/plan.hpp"

namespace clerestory {
namespace {

/// Weights of one sign: sums over channels and rays lose no digits that are not the op's to lose.
Tensor weights_of(const Shape& shape, std::uint64_t seed, bool first_ray) {
  Tensor weights = rounded_to_float(random_tensor(shape, seed, 0.5, 1.5));
  if (first_ray)
    for (std::size_t i = 0; i < weights.real.size(); ++i)
      if (i % static_cast<std::size_t>(shape.w) > 0) weights.real[i] = 0;
  return weights;
}

/// Those of the formula, and as they start in float the others.
std::shared_ptr<States> states_of(const Graph& graph, const Formula& formula, const Device& device,
                                  Precision precision) {
  if (graph.states().empty()) return nullptr;
  States start(device);
  start.initialise(graph, formula.seed);
  auto states = std::make_shared<States>(device, precision);
  for (const std::string& name : start.names()) {
    const auto given = formula.states.find(name);
    states->set(name, given == formula.states.end() ? start.get(name) : rounded_to_float(given->second));
  }
  return states;
}

}  // namespace

const std::vector<StabilityCase>& stability_cases() {
  static const std::vector<StabilityCase> all = [] {
    std::vector<StabilityCase> cases;
    for (const auto make :
         {brdf_stability, sample_stability, field_stability, ray_stability, uncertainty_stability, loss_stability,
          norm_stability, optimiser_stability, hypernetwork_stability, scene_stability})
      for (StabilityCase& c : make()) cases.push_back(std::move(c));
    return cases;
  }();
  return all;
}

Evaluations evaluate_formula(const Formula& formula, const Device& device, Precision precision) {
  Graph graph;
  Values values;
  for (const auto& [name, tensor] : formula.inputs) values[name] = graph.input(name, tensor.shape, tensor.type());
  const std::vector<Compared> compared = formula.build(graph, values);
  std::vector<Value> outputs, from, seeds, wrt;
  for (const Compared& c : compared) {
    outputs.push_back(c.value);
    if (!c.weighed) continue;
    from.push_back(c.value);
    seeds.push_back(graph.constant(weights_of(c.value.shape(), outputs.size(), formula.first_ray)));
  }
  for (const std::string& name : formula.differentiate) wrt.push_back(values.at(name));
  if (!wrt.empty())
    for (const Value& g : gradient(from, seeds, wrt)) outputs.push_back(g);
  const std::shared_ptr<States> states = states_of(graph, formula, device, precision);
  Executor executor(compile(graph, outputs, device, {.precision = precision}, true), states);
  for (const auto& [name, tensor] : formula.inputs) executor.feed(name, rounded_to_float(tensor));
  executor.run(formula.seed);
  Evaluations found;
  for (std::size_t i = 0; i < outputs.size(); ++i)
    (i < compared.size() ? found.values : found.gradients).push_back({executor.fetch(outputs[i])});
  for (const auto& [name, tensor] : formula.states) found.values.push_back({states->get(name)});
  return found;
}

StabilityCase case_of(const std::string& group, const std::string& name, const Formula& formula) {
  return {.group = group, .name = name, .evaluate = [formula](const Device& device, Precision precision) {
            return evaluate_formula(formula, device, precision);
          }};
}

StabilityCase outside(StabilityCase c) {
  c.inside = false;
  return c;
}

std::vector<double> spread_logarithms(int count, double low, double high, std::uint64_t seed) {
  std::vector<double> numbers;
  for (int i = 0; i < count; ++i) numbers.push_back(low * std::pow(high / low, i / std::max(count - 1.0, 1.0)));
  std::shuffle(numbers.begin(), numbers.end(), std::mt19937_64(seed));
  return numbers;
}

}  // namespace clerestory
