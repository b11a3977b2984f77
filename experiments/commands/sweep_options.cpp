#include "experiments/commands/sweep_options.hpp"

#include <cstdio>

#include "experiments/studies/sweep.hpp"

namespace clerestory {

void add_sweep_options(Command& command, SweepOptions& to) {
  command.flag("-m,--multirun", sweep_words, to.many)
      .flag("--list",
            "Runs nothing: prints a command for each run of the sweep, for other machines (experiments/cluster). Each "
            "can be given again, and a run that another process is at work on is not touched",
            to.list)
      .option("--only", "RUN", "Of the sweep the one run of this name, which --list prints; no tables over all",
              to.only);
}

void check_sweep_options(const SweepOptions& options, bool sweeps) {
  if (options.list && !options.only.empty()) throw usage_error("one of the two", "--list and --only");
  if ((options.list || !options.only.empty()) && !sweeps)
    throw usage_error("is about the runs of a sweep", options.list ? "--list" : "--only", {}, "-m beside it");
}

void print_sweep(const std::vector<std::string>& names, const std::vector<std::string>& command) {
  std::fputs(sweep_commands(names, command).c_str(), stdout);
}

}  // namespace clerestory
