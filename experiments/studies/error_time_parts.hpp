// What the study of error against time measures: its parts, their estimators, the keys that choose them.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "host/io/config.hpp"
#include "nets/timed_layer.hpp"

namespace clerestory {

/// A way to have a picture or its gradients; the samples are the row's.
struct TimedEstimator {
  std::string name;
  RenderSettings settings;  // without nets
  LayerResult result = LayerResult::Picture;
  int batches = 1;  // of TimedLayer; more state their standard error
};

/// Estimators of one thing, beside one truth.
struct ErrorTimePart {
  std::string name;                    // of its keys, and of its table
  std::string title;                   // of its table
  std::string light;                   // in the table of all parts
  std::string note = {};               // what the table's first sentence says of it
  std::vector<std::string> what = {};  // TimedLayer::values()
  std::vector<std::int64_t> spp = {};
  std::vector<TimedEstimator> estimators = {};
  TimedEstimator truth = {};
  int truth_runs = 4, truth_spp = 0;  // independent runs, and samples a pixel of all together
  std::optional<double> floor = {};   // of ErrorReference
  /// The first estimator is the plain one, which the others change in one part each and the last in all: whether rays
  /// share answers is decided as `clerestory invert` decides it, and table "by_part" has the factors.
  bool against_plain = false;
};

void add_error_time_keys(Schema& schema);

/// The parts that a config asks for, those without estimators left out. Throws usage_error naming the key: samples that
/// do not rise, too few for a truth, one seed alone, no part at all.
std::vector<ErrorTimePart> error_time_parts(const Config& config);

}  // namespace clerestory
