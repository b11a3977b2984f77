// clerestory data check.
#pragma once
#include "experiments/commands/cli.hpp"

namespace clerestory {

void add_data_commands(CommandLine& line);

}  // namespace clerestory
