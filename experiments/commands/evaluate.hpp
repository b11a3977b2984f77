// clerestory evaluate: errors of predicted maps on views whose truth is known, and of depth on measured photographs.
#pragma once
#include "experiments/commands/cli.hpp"

namespace clerestory {

void add_evaluate_command(CommandLine& line);

}  // namespace clerestory
