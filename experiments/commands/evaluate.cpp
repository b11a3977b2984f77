#include "experiments/commands/evaluate.hpp"

#include <cstdio>

#include "experiments/applications/run_folder.hpp"
#include "experiments/training/evaluate_benchmark.hpp"
#include "experiments/weights/method.hpp"
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

void print(const BenchmarkResult& result) {
  std::string text;
  for (const auto& [name, value] : result.facts) text += fmt::format("{}: {}\n", name, value);
  text += "\n" + table_text(benchmark_table(result)) + "\nConventions\n";
  for (const std::string& line : result.conventions) text += "  - " + line + "\n";
  std::fputs(terminal_text(text).c_str(), stdout);
}

struct Options {
  EvaluateOptions evaluate;
  std::filesystem::path run, maps, list;
  std::string protocol, albedo, method;
  bool no_rivals = false;
};

bool shown(const CommonOptions& common) { return !common.json || !common.json->empty(); }

/// What does not go together, before any work.
void check(const Options& options, const CommonOptions& common) {
  const auto refuse = [](const char* option, bool given, const char* beside) {
    if (given) throw usage_error(fmt::format("does not go with {}", beside), option);
  };
  const EvaluateOptions& o = options.evaluate;
  if (o.batch < 1 || o.batch > 8) throw usage_error("out of range", "--batch", fmt::format("{}", o.batch), "1 to 8");
  const bool maps = !options.maps.empty(), protocol = !options.protocol.empty();
  if (!options.run.empty() && o.data.empty())
    throw usage_error("which view is this run of?", "--data", "none", "ROOM/NNN, which `invert` took apart");
  const bool weights = !common.weights.empty(), method = !options.method.empty();
  if (!options.run.empty())
    refuse("RUN", maps, "--maps"), refuse("RUN", protocol, "--protocol"), refuse("RUN", weights, "--weights"),
        refuse("RUN", method, "--method"), refuse("RUN", !o.frames.empty(), "--frames"),
        refuse("RUN", !o.mean_data.empty(), "--mean-data"), refuse("RUN", was_given(common, "--split"), "--split");
  if ((maps || protocol) && o.data.empty())
    throw usage_error("what are these to be judged on?", "--data", "none", "the folder of a data set");
  if (maps && options.albedo.empty())
    throw usage_error("how is the albedo of these maps stored?", "--albedo", "none",
                      "linear, or srgb for display values");
  if (!maps) refuse("--albedo", !options.albedo.empty(), "weights, whose albedo is linear");
  if (maps) refuse("--weights", weights, "--maps"), refuse("--method", method, "--maps");
  if (method) refuse("--weights", weights, "--method, which names them");
  if (maps || protocol) refuse("--frames", !o.frames.empty(), maps ? "--maps" : "--protocol");
  if (maps || protocol) refuse("--mean-data", !o.mean_data.empty(), maps ? "--maps" : "--protocol");
  if (!protocol) refuse("--list", !options.list.empty(), "rooms, which have --split");
}

std::filesystem::path weights_of(const Options& options, const CommonOptions& common) {
  return options.method.empty() ? weights_or_shipped(common.weights) : find_method(options.method, "--method").maps;
}

void judge_by_protocol(const Options& options, const CommonOptions& common) {
  BenchmarkOptions o;
  o.protocol = options.protocol, o.data = options.evaluate.data, o.maps = options.maps;
  o.list = {options.list, options.evaluate.split}, o.albedo = albedo_code(options.albedo);
  if (options.maps.empty()) o.weights = weights_of(options, common);
  o.device = common.device, o.gemm = common.gemm, o.tile = common.tile;
  const BenchmarkResult result = evaluate_benchmark(o);
  if (shown(common)) print(result);
  write_json_result(common, benchmark_json(result));
}

EvaluateOutcome judged(Options& options, const CommonOptions& common) {
  EvaluateOptions& o = options.evaluate;
  o.rivals = !options.no_rivals;
  if (!options.maps.empty()) return evaluate_maps(options.maps, albedo_code(options.albedo), o);
  if (!options.run.empty()) {
    const FolderLock lock = lock_run(options.run, LockKind::Read);
    return evaluate_run(options.run, o.data, o.rivals);
  }
  o.device = common.device, o.gemm = common.gemm, o.tile = common.tile;
  o.weights = weights_of(options, common);
  return evaluate_weights(o);
}

void run(Options& options, const CommonOptions& common) {
  check(options, common);
  if (!options.protocol.empty()) return judge_by_protocol(options, common);
  const EvaluateOutcome outcome = judged(options, common);
  if (shown(common)) print(outcome);
  write_json_result(
      common, evaluation_json(outcome.summary, outcome.views, outcome.frames, outcome.conventions, outcome.facts));
}

}  // namespace

void add_evaluate_command(CommandLine& line) {
  auto options = std::make_shared<Options>();
  EvaluateOptions& o = options->evaluate;
  line.add("evaluate", "Judges weights, or maps of any method, on views with known maps and on photographs")
      .optional_argument("RUN",
                         "A RUN folder of `invert` to judge in place of weights; --data is then the view ROOM/NNN that "
                         "was taken apart",
                         options->run)
      .option("--data", "DIR", "Folder of rooms (InteriorVerse's layout); with --protocol also IIW, NYUv2 or OpenRooms",
              o.data)
      .option("--split", "NAME",
              "Its list of rooms: test, val, train; default: test.txt, else val.txt, else every room. Of IIW: test "
              "(every fifth picture), train or all",
              o.split)
      .choice("--protocol",
              "Judge as others do, and say how: zhu and li IIW, NYUv2 and rooms, marigold the albedo of rooms",
              options->protocol, {"zhu", "li", "marigold"})
      .option("--method", "NAME|DIR", "Whose net: zhu, li2020, or a folder of weights, in place of --weights",
              options->method)
      .option("--list", "FILE", "Pictures of IIW or NYUv2 to judge, one a line", options->list)
      .option(
          "--maps", "DIR",
          "Maps of any method in place of weights: NAME/albedo.exr, normal, depth, material, or NAME_albedo.exr; NAME "
          "is ROOM/NNN, or a picture's",
          options->maps)
      .choice("--albedo", "How the albedo of --maps is stored; srgb: v^(1/2.2)", options->albedo, {"srgb", "linear"})
      .option("--frames", "DIR", "Folder with a photograph and measured depth (repeat for several)",
              [options](const std::string& text) { options->evaluate.frames.emplace_back(text); })
      .option("--mean-data", "DIR",
              "Training rooms to take the mean maps from, in place of those stored in the weights", o.mean_data)
      .option("--batch", "N", "Views at once, 1 to 8", o.batch)
      .flag("--no-rivals", "Leave out Retinex and the box of lines, which take about half a second a view",
            options->no_rivals)
      .common({Common::Weights, Common::Device, Common::Gemm, Common::Tile, Common::Json, Common::Quiet})
      .run([options](const CommonOptions& common) { run(*options, common); });
}

}  // namespace clerestory
