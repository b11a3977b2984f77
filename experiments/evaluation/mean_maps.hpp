// What a blind predictor can know: the per-pixel mean of the training set's maps. Small enough to ship inside the
// weights, so that an evaluation anywhere compares with the same one.
#pragma once
#include "experiments/evaluation/prepare.hpp"
#include "host/io/safetensors.hpp"

namespace clerestory {

/// Sums maps of one proportion on a coarse grid. Depth is averaged as its logarithm (the error is one of logarithms),
/// normals as vectors, albedo, roughness and metallic as they are, each over the pixels where it is known.
class MeanMaps {
 public:
  static constexpr int grid_width = 40, grid_height = 30;

  MeanMaps();
  void add(const PreparedView& view);
  long views() const { return views_; }

  /// The means as maps of the given size (bilinear), normals of unit length. A cell that no view knows takes the mean
  /// of all cells. Throws Error when nothing was added.
  MapSet maps(int width, int height) const;

  /// Tensors "mean_maps.*" and the number of views, in a file with others; and back, checked.
  void store(TensorFile& file) const;
  static MeanMaps restore(const TensorFile& file, const std::string& where);
  /// What a file gives back: every known cell counts once. Judging with this form gives one figure before and after.
  MeanMaps as_stored() const;
  static bool stored(const TensorFile& file) { return file.tensors.count("mean_maps.mean") > 0; }

 private:
  static constexpr int channels = 9;  // albedo 3, normal 3, log depth, roughness, metallic
  std::vector<double> sum_, weight_;  // channel, row, column
  long views_ = 0;
};

}  // namespace clerestory
