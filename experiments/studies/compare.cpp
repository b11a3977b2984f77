#include "experiments/studies/compare.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

// Sums of up to 64 samples in float before they go on in double: half an ulp each, relative to the mean.
constexpr double kRounding = 64 * 0x1p-24;
constexpr int kScales = 240;  // steps of a factor of 64: 1.7 % each

double rounding(double a, double b) { return kRounding * std::max(std::abs(a), std::abs(b)); }

/// Sums over the compared pixels of one channel scaled by `scale`: of relative and of clipped squared differences.
struct Sums {
  double relative = 0, clipped = 0;
};
Sums channel_sums(const Image& picture, const Image& truth, const std::vector<bool>& used, int c, double scale) {
  Sums sums;
  const float *ours = picture.plane(c), *theirs = truth.plane(c);
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const double value = scale * ours[i], wanted = theirs[i];
    const double d = value - wanted, e = std::min(value, 1.0) - std::min(wanted, 1.0);
    sums.relative += d * d / (wanted * wanted + 0.01), sums.clipped += e * e;
  }
  return sums;
}

PictureError error_of(const Sums& sums, const std::vector<bool>& used) {
  const double values = 3 * static_cast<double>(std::count(used.begin(), used.end(), true));
  if (values == 0) throw Error(ErrorKind::Failed, "no pixel to compare", "picture error");
  return {sums.relative / values, -10 * std::log10(std::max(sums.clipped / values, 1e-12))};
}

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

PictureError picture_error(const Image& picture, const Image& truth, const std::vector<bool>& used) {
  Sums all;
  for (int c = 0; c < 3; ++c) {
    const Sums s = channel_sums(picture, truth, used, c, 1);
    all.relative += s.relative, all.clipped += s.clipped;
  }
  return error_of(all, used);
}

PictureError best_scaled_error(const Image& picture, const Image& truth, const std::vector<bool>& used) {
  Sums all;
  for (int c = 0; c < 3; ++c) {
    Sums best = channel_sums(picture, truth, used, c, 1);
    for (int k = 0; k <= kScales; ++k) {
      const Sums s = channel_sums(picture, truth, used, c, 0.125 * std::pow(64.0, static_cast<double>(k) / kScales));
      best.relative = std::min(best.relative, s.relative), best.clipped = std::min(best.clipped, s.clipped);
    }
    all.relative += best.relative, all.clipped += best.clipped;
  }
  return error_of(all, used);
}

}  // namespace clerestory
