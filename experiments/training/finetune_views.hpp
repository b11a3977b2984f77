// Photographs of IIW and NYUv2 among the views of a training: the fine-tuning of Li et al. 2020, which Zhu et al. 2022
// name and do not release.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "experiments/training/training_views.hpp"
#include "host/io/iiw.hpp"
#include "host/io/nyu.hpp"

namespace clerestory {

struct FinetuneOptions {
  std::filesystem::path iiw;       // a folder, of which the training split is taken; empty: none
  std::filesystem::path nyu;       // a folder with kNyuFile, normals and masks; empty: none
  std::filesystem::path nyu_list;  // numbers of the pictures, one a line; empty: all
  double share = 0;                // of the views; of them each set brings half, where there are both
  bool on() const { return !iiw.empty() || !nyu.empty(); }
};

/// Most judgements of a kind, equal or not, that a photograph brings.
inline constexpr std::size_t kMostJudgements = 800;

/// Which photographs there are. Any thread may ask for one.
class FinetuneSet {
 public:
  /// Throws usage_error naming folder or file: no photographs, no normals of NYUv2, numbers that are not there.
  explicit FinetuneSet(const FinetuneOptions& options);
  ~FinetuneSet();
  FinetuneSet(const FinetuneSet&) = delete;
  FinetuneSet& operator=(const FinetuneSet&) = delete;

  std::vector<ViewName> names() const;  // those of IIW first
  std::string text() const;             // "and photographs in half of the views: ..."
  /// The photograph that stands at this position of the stream, cut as (seed, position) say; no value where a room's
  /// view stands there.
  MakeView at(std::uint64_t position, Size size, std::uint64_t seed);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The stream with photographs of `set`, which it shares, in place of some of the views.
std::unique_ptr<TrainingViews> finetune_views(std::unique_ptr<TrainingViews> rooms, std::shared_ptr<FinetuneSet> set,
                                              Size size, std::uint64_t seed);

/// A photograph of linear values scaled until it covers `size` and cut there at a place that `key` draws. No map is
/// known; `judged` are those of its judgements that count for WHDR and whose points lie in the cut, at most
/// kMostJudgements of a kind, a weight divided by how many of its kind there are.
PreparedView iiw_view(const Image& linear, const Judgements& judgements, Size size, std::uint64_t key);

/// A cut of 560 to 600 of 640 pixels' width, channels times 0.8 to 1.2, all by `key`. Depth and normals are known where
/// the normal counts and the depth lies between kNearestJudged and kFarthestJudged.
PreparedView nyu_view(const Image& linear, const Image& depth, const NyuNormals& normals, Size size, std::uint64_t key);

}  // namespace clerestory
