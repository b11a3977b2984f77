// The same judgement in training and in `clerestory evaluate`.
#pragma once
#include "experiments/evaluation/summary.hpp"
#include "experiments/training/network.hpp"

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

std::vector<ViewResult> results_of(const std::vector<JudgedView>& views);

}  // namespace clerestory
