// How far radiance is from the truth, of pictures and of light along rays alike. What nets are trained with (logarithms
// and relative errors) is one part of it; the others are measures that nothing was trained with.
#pragma once
#include <array>
#include <vector>

#include "host/math/radiance.hpp"

namespace clerestory {

/// As a screen shows linear radiance, 0 to 1.
inline constexpr double kShownGamma = 2.2;
double shown_value(double linear);
/// |answer - truth| / (|answer| + truth + 0.01), of which SMAPE is the mean.
double symmetric_error(double answer, double truth);

/// Over values y (channels of pixels or rays; at least 0 in logarithms) and truths t:
struct RadianceError {
  double relmse = 0;      // mean of (y - t)^2 / (t^2 + 0.01)
  double log_rmse = 0;    // root of the mean of ln((y + 0.01) / (t + 0.01))^2
  double smape = 0;       // mean of |y - t| / (|y| + t + 0.01), 0 to 1
  double psnr = 0;        // dB, of linear values clipped at 1
  double shown_psnr = 0;  // dB, of what a screen shows: clamp(y, 0, 1)^(1/2.2)
  double median_log = 0;  // median of ln((y + 0.01) / (t + 0.01)): below 0 too dark, above it too bright
  int views = 0;          // how many the means are over

  /// Sums over views, then their means.
  void add(const RadianceError& view);
  void divide_by_views();
};

/// A figure of a RadianceError as records and tables name it.
struct RadianceFigure {
  const char *key, *name, *unit;
  int digits;
  double RadianceError::*value;
};
inline constexpr RadianceFigure kShownPsnr{"shown_psnr", "PSNR as shown", "dB", 3, &RadianceError::shown_psnr};
inline constexpr RadianceFigure kSmape{"smape", "SMAPE", "eps 0.01", 3, &RadianceError::smape};
inline constexpr RadianceFigure kMedianLog{"median_log", "median ln", "answer / truth", 2, &RadianceError::median_log};
inline constexpr RadianceFigure kRelMse{"relmse", "relMSE", "eps 0.01", 3, &RadianceError::relmse};
inline constexpr RadianceFigure kLogRmse{"log_rmse", "log-RGB RMSE", "eps 0.01", 3, &RadianceError::log_rmse};
/// Nothing was trained with the first three; nets of the light are trained with the last two or what is close to them.
inline constexpr std::array kRadianceFigures{kShownPsnr, kSmape, kMedianLog, kRelMse, kLogRmse};

/// Adds up values of one picture or one set of rays.
class RadianceErrorSums {
 public:
  void add(double answer, double truth, double weight = 1);
  bool empty() const { return weights_.empty(); }
  /// Throws Error when nothing was added.
  RadianceError error() const;
  /// The same without the median, which takes a sort.
  RadianceError means() const;

 private:
  double weight_ = 0, relative_ = 0, symmetric_ = 0, clipped_ = 0, shown_ = 0, squared_logs_ = 0;
  std::vector<double> logs_, weights_;
};

/// The values at which the running sum of weights reaches shares of it, which rise.
std::vector<double> weighted_quantiles(const std::vector<double>& values, const std::vector<double>& weights,
                                       const std::vector<double>& shares);
double weighted_quantile(const std::vector<double>& values, const std::vector<double>& weights, double q);

}  // namespace clerestory
