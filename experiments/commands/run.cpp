#include "experiments/commands/run.hpp"

#include <cstdio>

#include "experiments/cli.hpp"
#include "experiments/studies/study.hpp"

namespace clerestory {

void add_run_command(CommandLine& line) {
  const auto words = std::make_shared<std::vector<std::string>>();
  Command command = line.add("run", "Run a study from its config: a table with error and seconds");
  command.arguments("CONFIG [KEY=VALUE...]", "Config file, then overrides such as study.seeds=5", *words, 1)
      .common({Common::Device, Common::Quiet})
      .notes(
          "Prints the run directory. An interrupted study goes on with the same command, a finished one is skipped.");
  command.run([words](const CommonOptions& common) {
    std::vector<std::string> overrides(words->begin() + 1, words->end());
    if (!common.device.empty()) overrides.push_back("run.device=" + common.device);
    const Config config = load_config(words->front(), study_schema(), overrides);
    std::printf("%s\n", run_study(config, common.command).c_str());
  });
}

}  // namespace clerestory
