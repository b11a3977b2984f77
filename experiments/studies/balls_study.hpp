// Balls put into generated rooms under `light = image` and under `panorama`, beside the tracer's balls in the same
// places (`clerestory generate --balls`): errors on the pixels that show the ball.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// study.kind = "balls". Returns the run directory.
std::string run_balls_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
