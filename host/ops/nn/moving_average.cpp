#include "host/ops/nn/moving_average.hpp"

#include "host/ops/nn/parameter_slots.hpp"

namespace clerestory {
namespace {

struct MovingAverageOp : NotDifferentiable {  // average and parameter of each; step
  double keep;
  int parameters;
  MovingAverageOp(double k, int p) : keep(k), parameters(p) {}
  std::string name() const override { return "moving_average"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {}; }

  void launch(Launch& l) const override {
    std::vector<Slot<2>> slots;
    for (int i = 0; i < parameters; ++i)
      slots.push_back({{l.in(2 * i), l.in(2 * i + 1)}, static_cast<int>(l.in(2 * i).shape.count())});
    run_slots<2>(l, "nn/moving_average.cl", "moving_average", slots, l.inputs.back(), Launch::Real{keep});
  }

  std::vector<int> writes() const override {
    std::vector<int> written;
    for (int i = 0; i < parameters; ++i) written.push_back(2 * i);
    return written;
  }
};

}  // namespace

std::string average_name(const std::string& parameter) { return "average." + parameter; }

void moving_average(std::span<const Value> parameters, Value step, double keep) {
  if (parameters.empty()) return;
  Graph& graph = step.graph();
  std::vector<Value> inputs;
  for (const Value& p : parameters) {
    const std::string& name = state_of(p).state_name;
    inputs.insert(inputs.end(), {graph.state(average_name(name), p.shape(), Init::fixed(0)), p});
  }
  inputs.push_back(step);
  graph.make<MovingAverageOp>(inputs, keep, static_cast<int>(parameters.size()));
}

}  // namespace clerestory
