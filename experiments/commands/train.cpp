#include "experiments/commands/train.hpp"

#include <cmath>
#include <cstdio>

#include "experiments/commands/sweep_options.hpp"
#include "experiments/studies/study.hpp"
#include "experiments/studies/sweep.hpp"
#include "experiments/training/schema.hpp"
#include "experiments/training/trainer.hpp"
#include "experiments/weights/weights.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

struct TrainArguments {
  std::vector<std::string> words;  // config, then overrides
  std::string init;
  std::optional<std::uint64_t> seed;
  bool keys = false;
  SweepOptions sweep;
};

/// The last validation behind a run's weights, in one row.
RunTables validation_row(const std::filesystem::path& run) {
  const History history = read_history(run / "artifacts/weights.safetensors");
  const HistoryPoint& last = history.legs.back().curve.back();
  Table table;
  table.title = "Validation of the weights";
  table.columns = {{"score", "mean ratio", Best::Lowest, 4}};
  std::vector<Cell> row{Measure{last.score}};
  const std::vector<ErrorName>& names = error_names(history.kind());
  for (std::size_t i = 0; i < names.size(); ++i) {
    table.columns.push_back({names[i].name, names[i].unit, Best::Lowest, 4});
    row.push_back(std::isfinite(last.errors[i]) ? Cell(Measure{last.errors[i]}) : Cell());
  }
  table.columns.push_back({"training", "hours", Best::None, 3});
  row.push_back(Measure{history.hours()});
  table.add(std::move(row));
  return {{"validation", std::move(table)}};
}

void sweep_trainings(const TrainArguments& arguments, const std::vector<std::string>& overrides,
                     const std::vector<std::string>& fixed, const CommonOptions& common) {
  const std::string& config = arguments.words[0];
  const std::string& only = arguments.sweep.only;
  const Schema schema = training_schema();
  if (arguments.sweep.list) return print_sweep(sweep_names(config, schema, overrides, fixed), common.command);
  const SweepTask task{[&](const Config& one) { train(one, common.command); }, validation_row};
  const auto folder = only.empty() ? run_sweep(config, schema, overrides, fixed, common.command, task)
                                   : run_of_sweep(config, schema, overrides, fixed, only, task);
  std::printf("%s\n", folder.c_str());
}

void run_train(const TrainArguments& arguments, const CommonOptions& common) {
  if (arguments.keys) {
    std::fputs(config_page(training_schema(), "Keys of a training config").c_str(), stdout);
    return;
  }
  if (arguments.words.empty())
    throw usage_error("which config?", "CONFIG", "", "a TOML file, such as experiments/configs/mgnet_compact.toml");
  catch_interrupts();
  if (is_study(arguments.words[0]))
    throw usage_error("is a study", arguments.words[0], "study.kind",
                      "a training's config; `clerestory run` takes this one");
  const std::vector<std::string> overrides(arguments.words.begin() + 1, arguments.words.end());
  std::vector<std::string> fixed;
  if (!arguments.init.empty()) fixed.push_back("model.init=" + arguments.init);
  if (!common.device.empty()) fixed.push_back("run.device=" + common.device);
  if (common.gemm != "auto") fixed.push_back("model.gemm=" + common.gemm);
  if (common.tile != "auto") fixed.push_back("run.tile=" + common.tile);
  if (arguments.seed) fixed.push_back(fmt::format("run.seed={}", *arguments.seed));
  check_sweep_options(arguments.sweep, arguments.sweep.many);
  if (arguments.sweep.many) return sweep_trainings(arguments, overrides, fixed, common);
  const Config config = load_config(arguments.words[0], training_schema(), overrides).with(fixed);
  std::printf("%s\n", train(config, common.command).weights.c_str());
}

}  // namespace

void add_train_command(CommandLine& line) {
  auto arguments = std::make_shared<TrainArguments>();
  Command command = line.add(
      "train",
      "Trains MGNet or the light on rooms written by `generate`; an interrupted run goes on, a finished one is "
      "skipped");
  command
      .arguments("CONFIG [KEY=VALUE...]",
                 "Config file, then overrides such as train.minutes=30 data.train=[rooms_a,rooms_b]", arguments->words)
      .option(
          "--init", "WEIGHTS",
          "Weights or a checkpoint to start from, for the light also the folder of its two files, or an encoder that "
          "`weights import` wrote (model.init)",
          arguments->init)
      .option("--seed", "N", "In place of the config's run.seed", arguments->seed);
  add_sweep_options(command, arguments->sweep);
  command.flag("--keys", "Prints every key with its default and meaning, as Markdown", arguments->keys)
      .common({Common::Device, Common::Gemm, Common::Tile, Common::Quiet})
      .notes(
          "Prints the path of the weights. Ctrl-C writes a checkpoint first (exit code 4); the same command goes on "
          "from it.")
      .run([arguments](const CommonOptions& common) { run_train(*arguments, common); });
}

}  // namespace clerestory
