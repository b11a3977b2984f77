#include "experiments/commands/run.hpp"

#include <cstdio>

#include "experiments/commands/cli.hpp"
#include "experiments/studies/study.hpp"
#include "experiments/studies/sweep.hpp"
#include "experiments/studies/training_study.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

struct RunArguments {
  std::vector<std::string> words;  // config, then overrides
  bool many = false;
};

/// Sweeps over variants and seeds by itself.
std::string run_trainings(const RunArguments& arguments, const std::vector<std::string>& overrides,
                          const std::vector<std::string>& fixed, const CommonOptions& common) {
  if (!arguments.many)
    for (const std::string& word : overrides)
      if (expand_sweep({word}).size() > 1) throw usage_error("an override lists several values", word, "", "-m");
  return run_training_study(arguments.words[0], overrides, fixed, common.command).string();
}

/// The command in one order, config first, whatever was typed: for provenance.
std::vector<std::string> command_of(const RunArguments& arguments, const CommonOptions& common) {
  std::vector<std::string> command{common.command.at(0), "run"};
  command.insert(command.end(), arguments.words.begin(), arguments.words.end());
  if (arguments.many) command.push_back("-m");
  if (!common.device.empty()) command.insert(command.end(), {"--device", common.device});
  if (common.gemm != "auto") command.insert(command.end(), {"--gemm", common.gemm});
  return command;
}

std::string run(const RunArguments& arguments, const CommonOptions& given) {
  catch_interrupts();
  CommonOptions common = given;
  common.command = command_of(arguments, given);
  const std::vector<std::string> overrides(arguments.words.begin() + 1, arguments.words.end());
  std::vector<std::string> fixed;
  if (!common.device.empty()) fixed.push_back("run.device=" + common.device);
  const std::string kind = study_kind(arguments.words[0], overrides);
  if (common.gemm != "auto") fixed.push_back((kind == "training" ? "model.gemm=" : "run.gemm=") + common.gemm);
  if (kind == "training") return run_trainings(arguments, overrides, fixed, common);
  const Schema schema = study_schema(kind);
  if (!arguments.many) return run_study(load_config(arguments.words[0], schema, overrides).with(fixed), common.command);
  for (const std::string& word : overrides)
    if (word.starts_with("run.seed="))
      throw usage_error("a study's run.seed names its directory and changes nothing else", word, "", "data.seed=...");
  const SweepTask task{[&](const Config& config) { run_study(config, common.command); }, study_tables};
  return run_sweep(arguments.words[0], schema, overrides, fixed, common.command, task);
}

}  // namespace

void add_run_command(CommandLine& line) {
  const auto arguments = std::make_shared<RunArguments>();
  line.add("run", "Run a study from its config: a table with error and seconds")
      .arguments("CONFIG [KEY=VALUE...]", "Config file, then overrides such as study.seeds=5", arguments->words, 1)
      .flag("-m,--multirun", sweep_words, arguments->many)
      .common({Common::Device, Common::Gemm, Common::Quiet})
      .notes(
          "Prints the run directory. An interrupted study goes on with the same command, a finished one is skipped. A "
          "study of trainings sweeps over its variants and seeds by itself.")
      .run([arguments](const CommonOptions& common) { std::printf("%s\n", run(*arguments, common).c_str()); });
}

}  // namespace clerestory
