// Many views' errors in one table: ours, each trivial predictor, and the ratio to the best of them.
#pragma once
#include <string>
#include <vector>

#include "experiments/evaluation/mean_maps.hpp"
#include "experiments/evaluation/rivals.hpp"
#include "host/report/table.hpp"

namespace clerestory {

/// One view: what was predicted, and what the trivial predictors get.
struct ViewResult {
  std::string view;
  MapErrors ours;
  MapErrors constant;                     // the best constant of this very view
  MapErrors mean_map;                     // the training set's mean, blind to the picture; absent without one
  MapErrors picture;                      // albedo only: the linear picture itself
  RivalErrors rivals;                     // simple methods that read no truth; absent where they were not asked
  std::optional<double> log_scale_error;  // |ln predicted - ln true scene_scale|
};

/// What the trivial predictors get on a view, our own errors left empty. `means` may be null.
ViewResult trivial_errors(const std::string& name, const PreparedView& view, const MapSet* means);
/// Fills in ours: predictions at the size of the prepared view; `log_scale` may be absent.
void judge(ViewResult& result, const PreparedView& view, const MapSet& predicted, std::optional<double> log_scale);

/// One metric over all views that have it.
struct MetricSummary {
  MapError error;
  int views = 0;
  Measure ours, constant, mean_map, picture;  // count 0 where there is none
  std::string best;                           // which trivial predictor has the least mean
  double ratio = 0;                           // mean of ours / mean of the best trivial predictor
  double strict_ratio = 0;                    // mean of ours / mean over views of the least trivial error of each view
  std::array<Measure, rival_count> rivals{};  // count 0 where there is none
  std::optional<std::size_t> best_rival;      // of those that answer every view, the one with the least mean
  /// mean of ours / mean of the best rival. `ratio` is to trivial predictors alone, so that it keeps its meaning.
  double rival_ratio = 0;
};

struct EvaluationSummary {
  std::vector<MetricSummary> metrics;  // those that at least one view has
  int views = 0;
  double median_log_scale_error = 0;  // of views whose scale was predicted
  int scale_views = 0;

  /// Geometric mean of the ratios: one figure to choose a checkpoint by. A ratio of 0 counts as 1e-6; one to a
  /// trivial error of 0 (no view has any metal) does not count.
  double score() const;
  const MetricSummary* find(MapError error) const;
};
EvaluationSummary summarise(const std::vector<ViewResult>& results);

/// A line that names the best simple rival of each map and how ours stands to it; empty where none was asked.
std::string rivals_text(const EvaluationSummary& summary);
/// Rows: metrics. Columns: ours, trivial predictors, ratios; simple rivals where there are any.
Table summary_table(const EvaluationSummary& summary, const std::string& title);
/// Every convention behind the table, a line each.
std::vector<std::string> evaluation_conventions(int width, int height);

/// Predicted depth on a photograph with measured depth.
struct FrameResult {
  std::string frame;
  double valid_share = 0;  // of pixels with a measurement
  double ours = 0, constant = 0;
  double scale = 0;   // predicted / measured 99th percentile of depth
  double metres = 0;  // median over pixels of predicted / measured metres
  std::optional<double> mean_map;
};
/// `measured`: metres, 0 none, any size; it is taken to the prediction's size by nearest neighbour. `log_scale`: of the
/// predicted 99th percentile of depth in metres.
FrameResult judge_frame(const std::string& name, const Image& predicted_depth, double log_scale, const Image& measured,
                        const MapSet* means);
Table frames_table(const std::vector<FrameResult>& frames);

/// All of it as JSON: summary, views, frames, conventions.
std::string evaluation_json(const EvaluationSummary& summary, const std::vector<ViewResult>& views,
                            const std::vector<FrameResult>& frames, const std::vector<std::string>& conventions,
                            const std::vector<std::pair<std::string, std::string>>& facts);

}  // namespace clerestory
