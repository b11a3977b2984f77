// The Monte Carlo layer and its gradients on one scene, compiled once and run by seeds, its seconds and memory taken.
#pragma once
#include <map>
#include <string>

#include "nets/scene_light.hpp"

namespace clerestory {

/// What is computed. With I the picture and P the photograph, the loss L is the mean of (I - P)^2 / (P^2 + 0.01) over
/// the channels of pixels that have a depth, and its gradient the sum of dL/dI dI over pixels.
enum class LayerResult {
  Picture,
  OneDraw,  // gradients with dL/dI and dI of the same samples: biased by their covariance. What rays meet is found once
  TwoDraws  // of independent samples: unbiased, as a product of independent factors is; the adjoint traces rays of its
            // own
};

class TimedLayer {
 public:
  /// `scene` must outlive it. From one sample a pixel on. Double precision takes a light without nets. `batches`: the
  /// samples come in so many parts of equal size, each with random numbers of its own and so, of Sobol's points,
  /// scrambled by itself; results are means over them. Throws what scene_light() and render_spec() throw, and
  /// usage_error for samples that are not a multiple of the batches.
  TimedLayer(const Device& device, const Scene& scene, const RenderSettings& settings, LayerResult result,
             Precision precision = Precision::Single, int batches = 1);

  /// Seconds from an idle device to the result, which does not leave the device in them; of several batches, which are
  /// added here, it does.
  double run(std::uint32_t seed);
  /// Of the last run, planar: "picture"; or gradients by "albedo", "roughness", "metallic", "normal" and "radiance",
  /// the last of what the light = image knows of the radiance that pixels send.
  std::map<std::string, std::vector<double>> values();
  /// Of each of those numbers, from the spread of the batches' own about their mean, of which there are at least two:
  /// right whatever the points are and wherever the noise is from (dL/dI and dI, rays that meet in one pixel), and
  /// known to 1 / sqrt(2 (batches - 1)) of itself.
  std::map<std::string, std::vector<double>> standard_errors() const;
  /// How often a run traces as many rays as the picture has samples.
  int traces() const;
  /// Bytes of device memory that it held at most.
  std::size_t memory() const { return device_.memory_peak() - held_before_; }

 private:
  std::map<std::string, std::vector<double>> fetched();
  void add_batch();
  Value picture_of(const SceneValues& values, const SceneLight& light, const RenderSpec& spec);
  void add_gradients(const SceneValues& values, const SceneLight& light, const RenderSpec& spec, LayerResult result);

  Device device_;
  std::size_t held_before_;
  Graph graph_;
  std::vector<std::pair<std::string, Value>> outputs_;
  std::optional<Executor> executor_;
  int batches_;
  int added_ = 0;                                               // batches of this run
  std::map<std::string, std::vector<double>> means_, squares_;  // of them: squares of distances from the mean
};

}  // namespace clerestory
