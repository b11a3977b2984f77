// MGNet as training drives it: fed batches, giving losses. The graphs come from nets/.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "experiments/training/batches.hpp"
#include "experiments/training/options.hpp"
#include "host/graph/plan.hpp"
#include "nets/mgnet.hpp"

namespace clerestory {

/// Losses of one step by name ("loss" is the weighted sum), in the graph's order.
using Losses = std::vector<std::pair<std::string, double>>;

/// Sums of squares of a parameter's gradient, and of itself before the step.
struct ParameterSquares {
  std::string name;
  double gradient = 0, value = 0;
};

/// What one step tells.
struct StepResult {
  Losses losses;
  std::vector<ParameterSquares> parameters;
};
/// The same of a plan that ran, whose outputs are the losses and what adam() gave for the parameters.
StepResult result_of(Executor& run, const NamedValues& losses, const std::vector<Value>& parameters, Value squares);

/// How a training graph is compiled: within the options' memory.
PlanOptions plan_options(const TrainingOptions& options);

class TrainingNetwork {
 public:
  /// Builds and compiles the training graph for the options' batch and (padded) size; makes the states that `states`
  /// lacks from the options' seed.
  TrainingNetwork(Device device, const TrainingOptions& options, std::shared_ptr<States> states);
  ~TrainingNetwork();

  /// One step of Adam. `step` counts from 0.
  StepResult step(const TrainingBatch& batch, double rate);

  std::size_t parameters() const;                  // numbers that are trained
  std::size_t bytes() const;                       // device memory beside the states
  const std::vector<std::string>& frozen() const;  // scopes that are not trained: their terms have no weight

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A line for the log; empty when nothing is frozen.
std::string frozen_note(const std::vector<std::string>& scopes);

}  // namespace clerestory
