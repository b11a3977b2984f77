// Moving averages of what is trained ("average.<parameter>", host/ops/nn/moving_average.hpp), which are judged and kept
// in the place of the parameters where train.average asks for them.
#pragma once
#include <map>
#include <memory>
#include <string>

#include "host/graph/plan.hpp"

namespace clerestory {

/// The states of a leg: what steps change, and what is judged and kept. Both are the same where nothing is averaged.
struct TrainingStates {
  std::shared_ptr<States> trained, judged;
};

/// Averages begin as the parameters are.
void begin_averages(States& states);

/// Into what is judged: of each of these states its average, or itself where there is none (running statistics,
/// parameters that no term sees).
void update_judged(const TrainingStates& states, const std::map<std::string, Shape>& names);

}  // namespace clerestory
