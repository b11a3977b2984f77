#include "experiments/commands/train.hpp"

#include <cstdio>

#include "experiments/training/trainer.hpp"

namespace clerestory {
namespace {

struct TrainArguments {
  std::vector<std::string> words;  // config, then overrides
  std::string init;
  bool keys = false;
};

void run_train(const TrainArguments& arguments, const CommonOptions& common, bool seed_given) {
  if (arguments.keys) {
    std::fputs(config_page(training_schema(), "Keys of a training config").c_str(), stdout);
    return;
  }
  if (arguments.words.empty())
    throw usage_error("which config?", "CONFIG", "", "a TOML file, such as experiments/configs/mgnet_compact.toml");
  std::vector<std::string> overrides(arguments.words.begin() + 1, arguments.words.end());
  if (!arguments.init.empty()) overrides.push_back("model.init=" + arguments.init);
  if (!common.device.empty()) overrides.push_back("run.device=" + common.device);
  if (common.gemm != "auto") overrides.push_back("model.gemm=" + common.gemm);
  if (seed_given) overrides.push_back(fmt::format("run.seed={}", common.seed));
  const Config config = load_config(arguments.words[0], training_schema(), overrides);
  const TrainingOutcome outcome = train(config, common.command);
  std::printf("%s\n", outcome.weights.c_str());
}

}  // namespace

void add_train_command(CommandLine& line) {
  auto arguments = std::make_shared<TrainArguments>();
  line.add("train",
           "Trains MGNet or the light on rooms written by `generate`; an interrupted run goes on, a finished one is "
           "skipped")
      .arguments("CONFIG [KEY=VALUE...]",
                 "Config file, then overrides such as train.minutes=30 data.train=[rooms_a,rooms_b]", arguments->words)
      .option("--init", "WEIGHTS", "Weights or a checkpoint to start from (model.init)", arguments->init)
      .flag("--keys", "Prints every key with its default and meaning, as Markdown", arguments->keys)
      .common({Common::Device, Common::Seed, Common::Gemm, Common::Quiet})
      .notes(
          "Prints the path of the weights. Ctrl-C writes a checkpoint first (exit code 4); the same command goes on "
          "from it.")
      .run([arguments](const CommonOptions& common) {
        bool seed_given = false;
        for (const std::string& word : common.command) seed_given |= word == "--seed" || word.starts_with("--seed=");
        run_train(*arguments, common, seed_given);
      });
}

}  // namespace clerestory
