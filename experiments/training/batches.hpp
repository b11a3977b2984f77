// The stream of training batches: which views, in which order, flipped and exposed how. Everything is a function of
// (seed, position), so a resumed run sees what an uninterrupted one would have seen, whatever the threads do, and a leg
// goes on where the leg before it ended. A position counts views over all legs.
#pragma once
#include <cstdint>
#include <future>
#include <string>
#include <vector>

#include "experiments/training/prefetch.hpp"
#include "experiments/training/training_views.hpp"
#include "host/graph/shape.hpp"

namespace clerestory {

/// What is fed to the training graph, NCHW, padded to net_multiple: the image by repetition, maps and masks with zeros.
struct TrainingBatch {
  std::int64_t step = 0;
  int n = 0, h = 0, w = 0;                                       // padded
  std::vector<float> image;                                      // n x 3: clamped to [0, 1]
  std::vector<float> albedo, normal;                             // n x 3
  std::vector<float> material;                                   // n x 2
  std::vector<float> depth;                                      // n x 1, clamped to [0, 1]
  std::vector<float> geometry_mask, albedo_mask, material_mask;  // n x 1
  std::vector<float> log_scale;                                  // n: ln scene_scale in metres, 0 where unknown
  std::vector<float> scale_mask;                                 // n: 1 where scene_scale is known
  std::vector<JudgedPixels> judged;                              // pixels counted over the padded batch, n h w
  std::vector<std::string> views;                                // for messages
};

struct Augmentation {
  bool flip = true;                                  // half of the views mirrored, n_x negated
  double exposure_low = 0.85, exposure_high = 0.95;  // 95th percentile of luminance, uniform; both 0.9: none
  double photographs = 0;                            // share of views seen through a camera (photo.hpp)
  double painted = 0;                                // share of views whose rooms are painted anew (new_paint.hpp)
};

/// One view, its picture times `gain`.
TrainingBatch assemble_batch(const PreparedView& view, bool flip, double gain);

/// Begins batch `step` of a leg whose first view is at position `first`. Each view is made by a thread of its own.
std::future<TrainingBatch> begin_batch(TrainingViews& views, const Augmentation& augmentation, std::uint64_t seed,
                                       std::int64_t first, std::int64_t step, int batch);

/// The batches of that leg from `first_step` on, a few being made at a time: a GPU takes a step in the time in which
/// one core makes two views. The views must outlive it.
class BatchStream {
 public:
  BatchStream(TrainingViews& views, const Augmentation& augmentation, std::uint64_t seed, std::int64_t first, int batch,
              std::int64_t first_step);
  /// As Prefetch::next().
  TrainingBatch next() { return begun_.next().get(); }

 private:
  Prefetch<std::future<TrainingBatch>> begun_;
};

}  // namespace clerestory
