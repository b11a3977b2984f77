// What `run` and `train` take for a sweep: all of it here, a list of its runs, or one of them.
#pragma once
#include <string>
#include <vector>

#include "experiments/commands/cli.hpp"

namespace clerestory {

struct SweepOptions {
  bool many = false;  // -m
  bool list = false;  // --list
  std::string only;   // --only; empty: all
};

/// Adds the three options to a command.
void add_sweep_options(Command& command, SweepOptions& to);

/// Throws usage_error for --list and --only together, or either where nothing is swept.
void check_sweep_options(const SweepOptions& options, bool sweeps);

/// The runs of a sweep on stdout, a command each. The names are sweep_names().
void print_sweep(const std::vector<std::string>& names, const std::vector<std::string>& command);

}  // namespace clerestory
