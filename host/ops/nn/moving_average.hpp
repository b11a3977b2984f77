// Moving average of parameters (kernels/nn/moving_average.cl), on the device.
#pragma once
#include <span>

#include "host/graph/graph.hpp"

namespace clerestory {

/// The state that averages a parameter.
std::string average_name(const std::string& parameter);

/// Appends one update of the averages of all parameters (states): a += (1 - keep) (p - a), with 0 <= keep < 1, less of
/// it in the first steps. `step` {1,1,1,1} is 1 for the first. Comes after what updates the parameters.
void moving_average(std::span<const Value> parameters, Value step, double keep);

}  // namespace clerestory
