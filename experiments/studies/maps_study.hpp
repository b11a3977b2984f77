// Maps side by side, as Zhu et al. 2022, figure 5, shows them: ours, those of a rival where one is named, and
// the truth, of photographs of rooms whose content no training has seen; with errors of both, of simple methods that
// read no truth, and of the view's best constant, which reads it.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// study.kind = "maps". Returns the run directory. Throws usage_error where weights are missing.
std::string run_maps_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
