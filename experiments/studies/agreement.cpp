#include "experiments/studies/agreement.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

// Sums of up to 64 samples in float before they go on in double: half an ulp each, relative to the mean.
constexpr double kRounding = 64 * 0x1p-24;

double rounding(double a, double b) { return kRounding * std::max(std::abs(a), std::abs(b)); }

}  // namespace

Agreement agreement(const Batches& ours, const Batches& theirs, const std::vector<bool>& used, double level) {
  const std::size_t batches = ours.size(), pixels = used.size();
  if (batches < 2 || theirs.size() != batches) throw Error(ErrorKind::Failed, "two batches at least", "agreement");
  const double limit = student_limit(level, static_cast<int>(batches) - 1);
  Agreement result;
  std::vector<double> of_batch(batches), whole(batches, 0);
  double total = 0;
  for (std::size_t i = 0; i < 3 * pixels; ++i) {
    if (!used[i % pixels]) continue;
    double our_sum = 0, their_sum = 0;
    for (std::size_t k = 0; k < batches; ++k) {
      of_batch[k] = ours[k].at(i) - theirs[k].at(i);
      our_sum += ours[k][i], their_sum += theirs[k][i], whole[k] += of_batch[k];
    }
    const auto n = static_cast<double>(batches);
    const double error = standard_deviation(of_batch) / std::sqrt(n);
    result.within += std::abs(mean(of_batch)) <= limit * error + rounding(our_sum / n, their_sum / n);
    result.values += 1, total += their_sum / n;
  }
  if (!(total > 0)) throw Error(ErrorKind::Failed, "no light to compare", "agreement");
  result.pixels = result.values / 3;
  result.difference = mean(whole) / total;
  result.error = standard_deviation(whole) / std::sqrt(static_cast<double>(batches)) / total;
  return result;
}

Agreement together(const std::vector<Agreement>& pictures) {
  Agreement all;
  double variance = 0;
  for (const Agreement& a : pictures) {
    all.pixels += a.pixels, all.values += a.values, all.within += a.within;
    all.difference += a.difference, variance += a.error * a.error;
  }
  const auto n = static_cast<double>(pictures.size());
  all.difference /= n, all.error = std::sqrt(variance) / n;
  return all;
}

double least_share(const Agreement& a, double level) { return level - 3 * std::sqrt(level * (1 - level) / a.pixels); }

double share_by_stated(const std::vector<double>& ours, const std::vector<double>& our_variance,
                       const std::vector<double>& theirs, const std::vector<double>& their_variance,
                       const std::vector<bool>& used, double level) {
  double within = 0, values = 0;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    if (!used[i % used.size()]) continue;
    const double d = std::max(std::abs(ours[i] - theirs[i]) - rounding(ours[i], theirs[i]), 0.0);
    const double error = std::sqrt(our_variance[i] + their_variance[i]);
    values += 1, within += d == 0 || (error > 0 && normal_two_sided_p(d / error) >= 1 - level);
  }
  return within / values;
}

}  // namespace clerestory
