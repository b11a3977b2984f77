// Balls put into generated rooms under several lights, beside the tracer's balls in the same places
// (`clerestory generate --balls`): errors on the pixels that show the ball, and of the light at its centre. Learned
// light is asked with true maps and with predicted ones, whose depth is brought to scale at the ball's foot.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// study.kind = "balls". Returns the run directory. Throws usage_error where weights are asked for and missing.
std::string run_balls_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
