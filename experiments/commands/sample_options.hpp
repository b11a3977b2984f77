// --sampler, --target-error and --seconds, as invert, insert and edit take them.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "experiments/applications/samples_record.hpp"
#include "experiments/commands/cli.hpp"

namespace clerestory {

struct SampleOptions {
  std::optional<double> error, seconds;
};

/// `of`: what the error is of, for --help. `more`: samplers that this command has beside those of all.
void add_sample_options(Command& command, RenderSettings& render, SampleOptions& options, const std::string& of,
                        const std::vector<std::string>& more = {});

/// Into `render`, whose light has been chosen: the default sampler, and --spp, which of a goal is the first round.
std::optional<RenderGoal> take_samples(const CommonOptions& common, const SampleOptions& options,
                                       RenderSettings& render);

}  // namespace clerestory
