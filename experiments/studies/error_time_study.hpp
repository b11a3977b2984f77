// Error against time of the differentiable Monte Carlo layer, by estimator: pictures under the photograph as light
// (samplers and points crossed), gradients, and pictures under learned light (one switch at a time).
//
// The truth is the layer's own under the same light by at least 16 times the samples of any row, in independent runs
// whose noise is not in the errors: these are the estimators' alone.
#pragma once
#include <string>
#include <vector>

#include "experiments/studies/error_time_parts.hpp"

namespace clerestory {

/// study.kind = "error_time". Returns the run directory. Throws what error_time_parts() throws.
std::string run_error_time_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
