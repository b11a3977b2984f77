// Whether two Monte Carlo estimates are of one picture.
#pragma once
#include <vector>

namespace clerestory {

/// Independent estimates of one picture: planar values of 3 channels each.
using Batches = std::vector<std::vector<double>>;

/// Whether two sets of estimates have one mean, value by value (a pixel's channel) and altogether.
struct Agreement {
  double pixels = 0, values = 0;  // compared
  double within = 0;              // values whose difference chance explains at the level asked for
  double difference = 0;          // ours less theirs, summed over all values, relative to their sum
  double error = 0;               // its standard error

  double share() const { return within / values; }
  double z() const { return difference / error; }
};

/// Estimate k of ours goes with estimate k of theirs: the differences are independent, their mean over its standard
/// error follows Student's t for any variances, as far as a batch's mean is normal. `used`: pixels compared. Throws on
/// less than two batches or unlike sizes.
Agreement agreement(const Batches& ours, const Batches& theirs, const std::vector<bool>& used, double level);
/// Of several pictures together: shares by values, differences by mean.
Agreement together(const std::vector<Agreement>& pictures);
/// Three standard deviations below `level`: what chance hardly undercuts. A pixel's channels vary as one.
double least_share(const Agreement& agreement, double level);

/// The share of values within normal limits by variances of the means themselves, as the estimators state them.
double share_by_stated(const std::vector<double>& ours, const std::vector<double>& our_variance,
                       const std::vector<double>& theirs, const std::vector<double>& their_variance,
                       const std::vector<bool>& used, double level);

}  // namespace clerestory
