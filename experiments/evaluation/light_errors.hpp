// Radiance along rays whose truth is known: errors, and how wide and how coloured the light is.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

namespace clerestory {

/// What keeps relative errors and logarithms finite in the dark; pictures have their 95th percentile at 0.9.
inline constexpr double kLightFloor = 0.01;

/// relMSE: mean over rays and channels of d^2 / (truth^2 + 0.01); log-RGB RMSE: root of the mean of
/// ln((y + 0.01) / (truth + 0.01))^2, y at least 0. `views`: how many the means are over.
struct LightError {
  double relmse = 0, log_rmse = 0;
  int views = 0;
};

/// Rays with known light. Answers are planar {3, count}; `used` lists the rays that count and is not empty.
class KnownRays {
 public:
  using Used = std::vector<std::size_t>;

  /// `weights`, of each ray, are positive (solid angles, say); none: all rays count alike.
  explicit KnownRays(std::vector<std::array<float, 3>> truth, std::vector<double> weights = {});
  std::size_t count() const { return truth_.size(); }

  LightError error(const std::vector<float>& planar, const Used& used) const;
  /// Of the constants, one a channel, that make each of the two errors least.
  LightError best_constant(const Used& used) const;
  /// relMSE that noise of the truth adds to every answer: mean of variance / (truth^2 + 0.01); `variance` planar.
  double noise(const std::vector<float>& variance, const Used& used) const;
  /// Mean angle between answer and truth as vectors of RGB, degrees; black has an angle of 90 to all.
  double angle(const std::vector<float>& planar, const Used& used) const;

 private:
  double truth(std::size_t c, std::size_t i) const { return static_cast<double>(truth_[i][c]); }
  double weight(std::size_t i) const { return weights_.empty() ? 1 : weights_[i]; }
  template <class Relative, class Logarithmic>
  LightError error_of(const Relative& relative, const Logarithmic& logarithmic, const Used& used) const;

  std::vector<std::array<float, 3>> truth_;
  std::vector<double> weights_;
};

/// ln of (99th percentile of luminance + 0.01) over (1st + 0.01). Percentiles are the values at which the running sum
/// of weights reaches a share of it.
double log_intensity_range(const std::vector<float>& planar, const std::vector<double>& weights);

/// Share of the gap from the photograph to the truth that an answer closes, (photo - ours) / (photo - noise) of relMSE;
/// NaN where the photograph is no further from the truth than the truth's own noise.
double gap_closed(double photo, double ours, double noise);

}  // namespace clerestory
