#include "experiments/studies/trained_run.hpp"

#include <limits>

namespace clerestory {

double step_seconds(const Leg& leg) {
  return leg.steps > 0 ? 3600 * leg.hours / static_cast<double>(leg.steps) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace clerestory
