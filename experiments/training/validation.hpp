// The same judgement in training and in `clerestory evaluate`.
#pragma once
#include "experiments/evaluation/summary.hpp"
#include "experiments/training/view_store.hpp"
#include "experiments/weights/map_predictor.hpp"

namespace clerestory {

/// A view with its truth, and what trivial predictors get on it.
struct JudgedView {
  PreparedView view;
  ViewResult result;
};

/// `count` numbers of 0 .. total - 1, evenly spread, in order; all of them when count is 0 or larger.
std::vector<std::size_t> spread(std::size_t total, std::size_t count);

/// Reads views and finds the trivial errors; `means` may be null.
std::vector<JudgedView> read_for_judgement(ViewStore& store, const std::vector<std::size_t>& which,
                                           const MapSet* means);

/// Predicts every view and fills in its errors.
void judge_all(std::vector<JudgedView>& views, MapPredictor& predictor);

/// A photograph with measured depth, as the nets see it.
struct JudgedFrame {
  std::string name;
  Image picture, depth;  // depth: metres, 0 none, at its own size
};
/// `longer`: of the picture's sides.
JudgedFrame read_frame(const std::filesystem::path& folder, int longer);
FrameResult judge(const JudgedFrame& frame, MapPredictor& predictor, const std::optional<MeanMaps>& means);

std::vector<ViewResult> results_of(const std::vector<JudgedView>& views);

}  // namespace clerestory
