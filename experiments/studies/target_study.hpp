// Error against time as a user asks for it: what `--target-error` gives. In rooms with true maps the re-render goes on
// until the error that it measures between rounds is the one asked for; beside it stand the error that it truly has,
// its samples and seconds, and the same of fixed numbers of samples, which know no error.
//
// The truth is the layer's own picture under the same light by many more samples, in two halves, so that an error holds
// no noise of the truth: it is the estimator's alone.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// Keys of its own.
void add_target_keys(Schema& schema);

/// study.kind = "target". Returns the run directory.
std::string run_target_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
