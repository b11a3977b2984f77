// clerestory train: one leg of training MGNet.
#pragma once
#include "experiments/commands/cli.hpp"

namespace clerestory {

void add_train_command(CommandLine& line);

}  // namespace clerestory
