// clerestory weights: what a weights file or checkpoint holds, and weights with their model card from either.
#pragma once
#include "experiments/commands/cli.hpp"

namespace clerestory {

void add_weights_commands(CommandLine& line);

}  // namespace clerestory
