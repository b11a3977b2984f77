// The study of the rendering layer: our Monte Carlo layer against the 8 x 16 grid of directions of Li et al. 2020, same
// light, same scenes, error and seconds.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// Keys of its own.
void add_layer_keys(Schema& schema);

/// study.kind = "layer". Returns the run directory.
std::string run_layer_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
