#include "experiments/training/averages.hpp"

#include "host/ops/nn/moving_average.hpp"

namespace clerestory {

void begin_averages(States& states) {
  for (const std::string& name : states.names())
    if (const std::string average = average_name(name); states.has(average)) states.set(average, states.get(name));
}

void update_judged(const TrainingStates& states, const std::map<std::string, Shape>& names) {
  if (states.judged == states.trained) return;
  for (const auto& [name, shape] : names) {
    const std::string average = average_name(name);
    states.judged->set(name, states.trained->get(states.trained->has(average) ? average : name));
  }
}

}  // namespace clerestory
