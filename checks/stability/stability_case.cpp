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

}  // namespace

const std::vector<StabilityCase>& stability_cases() {
  static const std::vector<StabilityCase> all = [] {
    std::vector<StabilityCase> cases;
    for (const auto make : {brdf_stability, sample_stability, field_stability, ray_stability, uncertainty_stability})
      for (StabilityCase& c : make()) cases.push_back(std::move(c));
    return cases;
  }();
  return all;
}

Evaluations evaluate_formula(const Formula& formula, const Device& device, Precision precision) {
  Graph graph;
  Values values;
  std::map<std::string, Tensor> feeds;
  for (const auto& [name, tensor] : formula.inputs) {
    values[name] = graph.input(name, tensor.shape, tensor.type());
    feeds[name] = rounded_to_float(tensor);
  }
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
  const std::vector<Tensor> got = evaluate(graph, outputs, device, feeds, {.precision = precision}, formula.seed);
  Evaluations found;
  for (std::size_t i = 0; i < got.size(); ++i)
    (i < compared.size() ? found.values : found.gradients).push_back({got[i]});
  return found;
}

std::vector<double> spread_logarithms(int count, double low, double high, std::uint64_t seed) {
  std::vector<double> numbers;
  for (int i = 0; i < count; ++i) numbers.push_back(low * std::pow(high / low, i / std::max(count - 1.0, 1.0)));
  std::shuffle(numbers.begin(), numbers.end(), std::mt19937_64(seed));
  return numbers;
}

}  // namespace clerestory
