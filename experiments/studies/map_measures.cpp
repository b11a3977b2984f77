#include "experiments/studies/map_measures.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/studies/edge_measures.hpp"
#include "experiments/studies/trained_run.hpp"
#include "experiments/training/evaluate.hpp"
#include "experiments/weights/weights.hpp"

namespace clerestory {
namespace {

Table measured_edges(const std::filesystem::path& run, const MapMeasuring& options) {
  Device device = Device::open(options.device);
  device.use_gemm(options.gemm);
  const std::vector<EdgeErrors> views = measure_edges(run / kLastWeights, options.test, device);
  write_judged_errors(run / kMeasuredErrors, edge_lists(views));
  return edge_table(views);
}

}  // namespace

const std::vector<std::string>& map_measures() {
  static const std::vector<std::string> measures{"edges"};
  return measures;
}

RunTables measure_maps(const std::filesystem::path& run, const MapMeasuring& options) {
  EvaluateOptions judging;
  judging.weights = run / kLastWeights;
  judging.data = options.test, judging.split = "test", judging.frames = options.frames;
  judging.device = options.device, judging.gemm = options.gemm;
  const EvaluateOutcome outcome = evaluate_weights(judging);
  const History history = read_history(judging.weights);
  const double steps = static_cast<double>(history.legs.back().steps);
  const double seconds = step_seconds(history.legs.back());

  Table table;
  table.title = fmt::format("Maps of {} views of unseen rooms and of {} photographs", outcome.views.size(),
                            outcome.frames.size());
  table.columns = {{"map"},
                   {"error", "", Best::Lowest, 4},
                   {"ratio", "to the best trivial answer", Best::Lowest, 3},
                   {"steps", "", Best::None, 4},
                   {"step", "s"}};
  const auto add = [&](const std::string& name, const Cell& error, double ratio) {
    table.add({name, error, std::isfinite(ratio) ? Cell(Measure{ratio}) : Cell(), Measure{steps},
               std::isfinite(seconds) ? Cell(Measure{seconds}) : Cell()});
  };
  for (const MetricSummary& m : outcome.summary.metrics) {
    const auto& metric = info(m.error);
    add(fmt::format("{}, {}", metric.name, metric.unit), Measure{m.ours.mean}, m.ratio);
  }
  add("all maps, geometric mean", Cell(), outcome.summary.score());
  for (const FrameResult& f : outcome.frames)
    add(fmt::format("depth of {}, rooted si-log", f.frame), Measure{f.ours},
        f.ours / std::min(f.constant, f.mean_map.value_or(f.constant)));
  RunTables tables{{"maps", table}};
  for (const std::string& measure : options.measures) tables[measure] = measured_edges(run, options);
  return tables;
}

}  // namespace clerestory
