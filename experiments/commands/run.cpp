#include "experiments/commands/run.hpp"

#include <cstdio>

#include "experiments/commands/cli.hpp"
#include "experiments/commands/sweep_options.hpp"
#include "experiments/studies/study.hpp"
#include "experiments/studies/sweep.hpp"
#include "experiments/studies/training_study.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

struct RunArguments {
  std::vector<std::string> words;  // config, then overrides
  SweepOptions sweep;
  bool keys = false;
};

/// Sweeps over variants and seeds by itself. Nothing to say when the runs were only listed.
std::string run_trainings(const RunArguments& arguments, const std::vector<std::string>& overrides,
                          const std::vector<std::string>& fixed, const CommonOptions& common) {
  const SweepOptions& sweep = arguments.sweep;
  check_sweep_options(sweep, true);
  if (!sweep.many)
    for (const std::string& word : overrides)
      if (expand_sweep({word}).size() > 1) throw usage_error("an override lists several values", word, "", "-m");
  if (!sweep.list) return run_training_study(arguments.words[0], overrides, fixed, common.command, sweep.only).string();
  print_sweep(training_study_names(arguments.words[0], overrides, fixed), common.command);
  return {};
}

/// A study, or a sweep of studies.
std::string run_studies(const RunArguments& arguments, const std::string& kind,
                        const std::vector<std::string>& overrides, const std::vector<std::string>& fixed,
                        const CommonOptions& common) {
  const SweepOptions& sweep = arguments.sweep;
  check_sweep_options(sweep, sweep.many);
  const std::string& config = arguments.words[0];
  const Schema schema = study_schema(kind);
  if (!sweep.many) return run_study(load_config(config, schema, overrides).with(fixed), common.command);
  for (const std::string& word : overrides)
    if (word.starts_with("run.seed="))
      throw usage_error("a study's run.seed names its directory and changes nothing else", word, "", "data.seed=...");
  const SweepTask task{[&](const Config& one) { run_study(one, common.command); }, study_tables};
  if (!sweep.only.empty()) return run_of_sweep(config, schema, overrides, fixed, sweep.only, task);
  if (!sweep.list) return run_sweep(config, schema, overrides, fixed, common.command, task);
  print_sweep(sweep_names(config, schema, overrides, fixed), common.command);
  return {};
}

/// The command in one order, config first, whatever was typed: for provenance.
std::vector<std::string> command_of(const RunArguments& arguments, const CommonOptions& common) {
  std::vector<std::string> command{common.command.at(0), "run"};
  command.insert(command.end(), arguments.words.begin(), arguments.words.end());
  if (arguments.sweep.many) command.push_back("-m");
  if (!arguments.sweep.only.empty()) command.insert(command.end(), {"--only", arguments.sweep.only});
  if (!common.device.empty()) command.insert(command.end(), {"--device", common.device});
  if (common.gemm != "auto") command.insert(command.end(), {"--gemm", common.gemm});
  return command;
}

/// Nothing where it left none.
std::string run(const RunArguments& arguments, const CommonOptions& given) {
  catch_interrupts();
  CommonOptions common = given;
  common.command = command_of(arguments, given);
  const std::vector<std::string> overrides(arguments.words.begin() + 1, arguments.words.end());
  std::vector<std::string> fixed;
  if (!common.device.empty()) fixed.push_back("run.device=" + common.device);
  const std::string kind = study_kind(arguments.words[0], overrides);
  if (arguments.keys) {
    std::fputs(config_page(study_schema(kind), fmt::format("Keys of a study of kind {}", kind)).c_str(), stdout);
    return {};
  }
  if (common.gemm != "auto") fixed.push_back((kind == "training" ? "model.gemm=" : "run.gemm=") + common.gemm);
  return kind == "training" ? run_trainings(arguments, overrides, fixed, common)
                            : run_studies(arguments, kind, overrides, fixed, common);
}

}  // namespace

void add_run_command(CommandLine& line) {
  const auto arguments = std::make_shared<RunArguments>();
  Command command = line.add("run", "Run a study from its config: a table with error and seconds");
  command.arguments("CONFIG [KEY=VALUE...]", "Config file, then overrides such as study.seeds=5", arguments->words, 1);
  add_sweep_options(command, arguments->sweep);
  command
      .flag("--keys", "Prints every key of the config's kind of study with its default, as Markdown", arguments->keys)
      .common({Common::Device, Common::Gemm, Common::Quiet})
      .notes(
          "Prints the run directory. An interrupted study goes on with the same command, a finished one is skipped. A "
          "study of trainings sweeps over its variants and seeds by itself.")
      .run([arguments](const CommonOptions& common) {
        if (const std::string place = run(*arguments, common); !place.empty()) std::printf("%s\n", place.c_str());
      });
}

}  // namespace clerestory
