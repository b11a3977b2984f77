// What the study of error against time reads off its measurements: errors without the noise of the reference, whether
// an estimator is biased, slopes, the Pareto front, seconds to an error. Plain arithmetic.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "host/math/welch.hpp"
#include "host/report/table.hpp"

namespace clerestory {

/// Planar values {channel, pixel} of one estimate; the random numbers of pixels are independent.
using Estimate = std::vector<double>;

/// What estimates are compared with: independent runs of one unbiased estimator, at least two. Squares of their mean
/// are taken as products of unlike runs, which hold no noise.
class ErrorReference {
 public:
  /// `floor` >= 0: squared errors of a value count over its own square + floor, and are averaged over the values that
  /// are `used`, one flag a pixel: relMSE. Without it they count over the square of all values together.
  ErrorReference(const std::vector<Estimate>& runs, std::vector<bool> used, std::optional<double> floor);

  /// Weighed squared error. Its expectation holds no noise of the reference, so it may fall below 0 by chance.
  double error(const Estimate& estimate) const;
  /// What estimates with these standard errors would have of it: their squares, weighed alike.
  double stated(const Estimate& standard_errors) const;

  /// Of estimates by several seeds, at least two, in the unit of error(): the squared bias of their estimator, the
  /// square of that number's standard error if there is none, and the estimator's variance. `shift`: how far the sum
  /// over all used values, each over the root of what its square counts over, is from the reference's: in it biases of
  /// one sign add up; with the squares of the standard errors of both.
  struct Moments {
    double bias = 0, bias_spread = 0, variance = 0, shift = 0, shift_spread = 0, truth_spread = 0;
  };
  Moments moments(const std::vector<Estimate>& estimates) const;

  const Estimate& mean() const { return mean_; }

 private:
  double sum_of(const Estimate& estimate) const;

  Estimate mean_, square_, weight_;
  std::vector<double> sums_;  // of the runs
  std::vector<bool> used_;
};

/// Of independent tests together (Fisher 1932); nothing where one has none.
std::optional<double> p_together(const std::vector<std::optional<double>>& tests);

/// y = exp(offset) x^slope, least squares in logarithms over the points where both are above 0.
/// Nothing for fewer than two of unlike x.
std::optional<double> log_log_slope(const std::vector<double>& x, const std::vector<double>& y);

/// Whether each point is on the Pareto front: no other is at most as large in both and smaller in one, and its error is
/// a number.
std::vector<bool> pareto_front(const std::vector<double>& seconds, const std::vector<double>& error);

/// Seconds at which a curve, its points in the order of their samples, first comes down to `error`: by the straight
/// line in logarithms between the points around it. Words where it lies outside of them: "< s" before the first, "> s"
/// behind the last.
Cell seconds_to(double error, const std::vector<double>& seconds, const std::vector<double>& errors);

/// How many times the seconds of `other` those of `plain` are, both as seconds_to() gives them: a bound where one of
/// them is one, nothing where two bounds say nothing.
Cell factor_of(const Cell& plain, const Cell& other);

}  // namespace clerestory
