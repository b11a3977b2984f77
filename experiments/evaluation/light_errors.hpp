// Radiance along rays whose truth is known: errors, and how wide and how coloured the light is.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "experiments/evaluation/radiance_error.hpp"

namespace clerestory {

/// Rays with known light. Answers are planar {3, count}; `used` lists the rays that count and is not empty.
class KnownRays {
 public:
  using Used = std::vector<std::size_t>;

  /// `weights`, of each ray, are positive (solid angles, say); none: all rays count alike.
  explicit KnownRays(std::vector<std::array<float, 3>> truth, std::vector<double> weights = {});
  std::size_t count() const { return truth_.size(); }

  RadianceError error(const std::vector<float>& planar, const Used& used) const;
  /// An oracle, which reads the truth: by every figure that of the constants, one a channel, which are best by it
  /// (SMAPE's among 256 quantiles of the truth).
  RadianceError best_constant(const Used& used) const;
  /// relMSE that noise of the truth adds to every answer: mean of variance / (truth^2 + 0.01); `variance` planar.
  double noise(const std::vector<float>& variance, const Used& used) const;
  /// Mean angle between answer and truth as vectors of RGB, degrees; black has an angle of 90 to all.
  double angle(const std::vector<float>& planar, const Used& used) const;

 private:
  double truth(std::size_t c, std::size_t i) const { return static_cast<double>(truth_[i][c]); }
  double weight(std::size_t i) const { return weights_.empty() ? 1 : weights_[i]; }
  double best_by_smape(std::size_t channel, const Used& used) const;
  /// The truth's values in the middles of `count` equal shares of the weight.
  std::vector<double> quantiles(std::size_t channel, const Used& used, int count) const;
  template <class Answer>
  RadianceError error_of(const Answer& answer, const Used& used) const;

  std::vector<std::array<float, 3>> truth_;
  std::vector<double> weights_;
};

/// ln of (99th percentile of luminance + 0.01) over (1st + 0.01). Percentiles are the values at which the running sum
/// of weights reaches a share of it.
double log_intensity_range(const std::vector<float>& planar, const std::vector<double>& weights);

/// Share of the way from a simple answer's error to that of the truth's own noise that an answer goes,
/// (simple - ours) / (simple - noise) of relMSE; NaN where the simple one is no further off than the noise.
double way_gone(double simple, double ours, double noise);

}  // namespace clerestory
