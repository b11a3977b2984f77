// Weights, or maps of any other method, judged by the protocol of others, or as `clerestory evaluate` judges its own.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "experiments/evaluation/benchmark.hpp"
#include "experiments/training/evaluate.hpp"

namespace clerestory {

struct BenchmarkOptions {
  std::string protocol;        // "zhu", "li", "marigold"
  std::filesystem::path data;  // of any layout that layout_of knows
  BenchmarkList list;
  std::filesystem::path maps;  // of another method; empty: weights predict
  AlbedoCode albedo = AlbedoCode::Linear;
  std::filesystem::path weights;
  /// A method that reads nothing but the picture (linear, of its own size), in place of weights; may be empty.
  std::function<PredictedMaps(const Image& picture)> method;
  std::string device, gemm = "auto", tile = "auto";
};

/// Weights predict at the size stored with them; what a protocol resizes, it resizes from there. Throws usage_error
/// when files do not fit, or the protocol says nothing of such a data set.
BenchmarkResult evaluate_benchmark(const BenchmarkOptions& options);

/// The five figures of `clerestory evaluate` for maps in `maps` of the views of a data set of rooms, each at the size
/// of its maps; what is not there has no figure.
EvaluateOutcome evaluate_maps(const std::filesystem::path& maps, AlbedoCode albedo, const EvaluateOptions& options);

}  // namespace clerestory
