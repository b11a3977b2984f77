// What weights carry about how they came to be: legs of training, and the curve of validation errors over all of them.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "experiments/evaluation/summary.hpp"
#include "host/report/plot.hpp"

namespace clerestory {

struct ErrorName {
  std::string key, name, unit;
};
/// The errors of a validation, in the order of HistoryPoint's lists. `kind`: what is trained, "maps" (MGNet) or "light"
/// (LightNet and the out-of-view field).
const std::vector<ErrorName>& error_names(const std::string& kind);

/// A validation's errors on one fixed list of rooms (data.lists), as HistoryPoint has them for the validation rooms.
struct ListErrors {
  std::string list;
  std::int64_t views = 0;
  double score = 0;
  std::vector<double> errors, ratios;
  double scale_error = 0;
};

/// Predicted depth on a photograph with measured depth (data.frames).
struct FrameErrors {
  std::string frame;
  double depth = 0, constant = 0;  // rooted si-log of ours, of the photograph's best constant
  double scale = 0;                // predicted / measured 99th percentile
};

/// One validation.
struct HistoryPoint {
  std::int64_t step = 0;       // of its leg
  double hours = 0;            // of training, all legs together
  double score = 0;            // geometric mean of the ratios to the best trivial predictor
  std::vector<double> errors;  // by error_names, NaN where a metric has no view
  std::vector<double> ratios;
  double scale_error = 0;  // maps: median |delta ln scene_scale|
  std::vector<ListErrors> lists = {};
  std::vector<FrameErrors> frames = {};
};
/// Without step and hours, lists and frames.
HistoryPoint history_point(const EvaluationSummary& summary);
/// What a point says of one list.
ListErrors list_errors(const std::string& list, std::int64_t views, const HistoryPoint& point);

/// One uninterrupted plan of training: a config on a set of views.
struct Leg {
  std::string kind = "maps";
  std::string experiment, variant, config_hash, commit, started;  // started: UTC
  std::string preset;
  int width = 0, height = 0, batch = 0;
  std::uint64_t seed = 0;
  std::int64_t rooms = 0, views = 0;  // of the training set
  std::int64_t steps = 0, views_seen = 0;
  double hours = 0;
  std::string init;                    // file name of the weights it started from; empty: random
  std::vector<std::string> overrides;  // keys that differ from the defaults, as "a.b=c"
  std::vector<HistoryPoint> curve;
};

struct History {
  std::vector<Leg> legs;
  std::string kind() const { return legs.empty() ? "maps" : legs.back().kind; }
  double hours() const;
  std::int64_t views_seen() const;
  /// Of the legs before the last: where the last one's stream of batches begins, so that legs of one seed go on through
  /// the same order instead of beginning it again.
  std::int64_t views_seen_before() const;
};
/// Whether a leg learned from photographs too (finetune.iiw, finetune.nyu).
bool saw_photographs(const History& history);

/// JSON text for a file's metadata, and back. Throws usage_error naming `where`.
std::string history_json(const History& history);
History history_from_json(const std::string& json, const std::string& where);

/// Ratios over hours: one curve per map, the score, and the line of the best trivial predictor.
Plot history_plot(const History& history);
/// The score over hours on validation rooms and on each fixed list, and of frames their mean ratio to the best
/// constant; no series where no leg was judged by lists.
Plot lists_plot(const History& history);

/// Plots of a card, as paths relative to it; empty where there is none.
struct CardPlots {
  std::string validation, lists;
};
/// The model card in Markdown. `facts`: file name, size, hash...
std::string model_card(const History& history, const std::vector<std::pair<std::string, std::string>>& facts,
                       const CardPlots& plots);

}  // namespace clerestory
