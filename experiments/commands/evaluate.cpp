#include "experiments/commands/evaluate.hpp"

#include <cstdio>

#include "experiments/applications/run_folder.hpp"
#include "experiments/training/evaluate.hpp"
#include "experiments/weights/shipped.hpp"
#include "host/report/terminal.hpp"

namespace clerestory {
namespace {

void print(const EvaluateOutcome& outcome) {
  std::string text;
  for (const auto& [name, value] : outcome.facts) text += fmt::format("{}: {}\n", name, value);
  text += "\n";
  if (!outcome.views.empty()) {
    text += table_text(summary_table(outcome.summary, "Errors: mean ± standard deviation over views")) + "\n";
    text += fmt::format("geometric mean of the ratios: {:.3f}\n", outcome.summary.score());
    if (const std::string best = rivals_text(outcome.summary); !best.empty()) text += best + "\n";
    if (outcome.summary.scale_views > 0)
      text += fmt::format("scene scale: median |delta ln| {:.3f} over {} views\n",
                          outcome.summary.median_log_scale_error, outcome.summary.scale_views);
    text += "\n";
  }
  if (!outcome.frames.empty()) text += table_text(frames_table(outcome.frames)) + "\n";
  text += "Conventions\n";
  for (const std::string& line : outcome.conventions) text += "  - " + line + "\n";
  std::fputs(terminal_text(text).c_str(), stdout);
}

}  // namespace

void add_evaluate_command(CommandLine& line) {
  auto options = std::make_shared<EvaluateOptions>();
  auto run = std::make_shared<std::filesystem::path>();
  auto no_rivals = std::make_shared<bool>(false);
  line.add("evaluate", "Judges weights on views with known maps and on photographs with measured depth")
      .optional_argument("RUN",
                         "A RUN folder of `invert` to judge in place of weights; --data is then the view ROOM/NNN that "
                         "was taken apart",
                         *run)
      .option("--data", "DIR", "Folder of rooms (InteriorVerse's layout)", options->data)
      .option("--split", "NAME",
              "Its list of rooms: test, val, train; default: test.txt, else val.txt, else every room", options->split)
      .option("--frames", "DIR", "Folder with a photograph and measured depth (repeat for several)",
              [options](const std::string& text) { options->frames.emplace_back(text); })
      .option("--mean-data", "DIR",
              "Training rooms to take the mean maps from, in place of those stored in the weights", options->mean_data)
      .option("--batch", "N", "Views at once, 1 to 8", options->batch)
      .flag("--no-rivals", "Leave out Retinex and the box of lines, which take about half a second a view", *no_rivals)
      .common({Common::Weights, Common::Device, Common::Gemm, Common::Tile, Common::Json, Common::Quiet})
      .run([options, run, no_rivals](const CommonOptions& common) {
        if (options->batch < 1 || options->batch > 8)
          throw usage_error("out of range", "--batch", fmt::format("{}", options->batch), "1 to 8");
        if (!run->empty() && options->data.empty())
          throw usage_error("which view is this run of?", "--data", "none", "ROOM/NNN, which `invert` took apart");
        options->rivals = !*no_rivals;
        options->device = common.device, options->gemm = common.gemm, options->tile = common.tile;
        if (run->empty()) options->weights = weights_or_shipped(common.weights);
        std::optional<FolderLock> lock;
        if (!run->empty()) lock.emplace(lock_run(*run, LockKind::Read));
        const EvaluateOutcome outcome =
            run->empty() ? evaluate_weights(*options) : evaluate_run(*run, options->data, options->rivals);
        if (!common.json || !common.json->empty()) print(outcome);
        write_json_result(common, evaluation_json(outcome.summary, outcome.views, outcome.frames, outcome.conventions,
                                                  outcome.facts));
      });
}

}  // namespace clerestory
