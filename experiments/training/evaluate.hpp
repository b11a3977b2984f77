// Weights judged on a data set and on photographs with measured depth.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/evaluation/summary.hpp"
#include "experiments/training/view_store.hpp"
#include "host/cl/device.hpp"

namespace clerestory {

struct EvaluateOptions {
  std::filesystem::path weights;
  std::filesystem::path data;                 // folder of rooms; empty: none
  std::string split;                          // list in it; empty: test.txt, else val.txt, else every folder with views
  std::vector<std::filesystem::path> frames;  // folders with rgb and measured depth
  std::filesystem::path mean_data;            // rooms to take the training mean from, in place of the weights' own
  int batch = 4;
  bool rivals = false;  // simple methods beside the trivial predictors
  std::string device, gemm = "auto", tile = "auto";
};

struct EvaluateOutcome {
  std::vector<ViewResult> views;
  EvaluationSummary summary;
  std::vector<FrameResult> frames;
  std::vector<std::string> conventions;
  std::vector<std::pair<std::string, std::string>> facts;  // weights, preset, data, views
};

/// Views of the wanted list; without one of test.txt, else val.txt, else of every folder, and `split` becomes what was
/// taken. Throws usage_error when there is none.
std::vector<ViewName> views_to_judge(const std::filesystem::path& data, std::string& split);

/// Throws usage_error when there is nothing to judge, or files do not fit.
EvaluateOutcome evaluate_weights(const EvaluateOptions& options);

/// A RUN folder of `invert` against the generated view ROOM/NNN that was its photograph, at the RUN's own size. The
/// mean map is absent. Throws usage_error when a map is missing or the proportions differ.
EvaluateOutcome evaluate_run(const std::filesystem::path& run, const std::filesystem::path& view, bool rivals = false);

}  // namespace clerestory
