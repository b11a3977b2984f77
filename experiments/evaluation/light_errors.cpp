#include "experiments/evaluation/light_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
KnownRays::KnownRays(std::vector<std::array<float, 3>> truth, std::vector<double> weights)
    : truth_(std::move(truth)), weights_(std::move(weights)) {
  if (!weights_.empty() && weights_.size() != truth_.size())
    throw Error(ErrorKind::Failed, "rays and weights of unlike number", "light errors");
}

template <class Answer>
RadianceError KnownRays::error_of(const Answer& answer, const Used& used) const {
  RadianceErrorSums sums;
  for (const std::size_t i : used)
    for (std::size_t c = 0; c < 3; ++c) sums.add(answer(c, i), truth(c, i), weight(i));
  return sums.error();
}

RadianceError KnownRays::error(const std::vector<float>& planar, const Used& used) const {
  return error_of([&](std::size_t c, std::size_t i) { return static_cast<double>(planar[c * truth_.size() + i]); },
                  used);
}

RadianceError KnownRays::best_constant(const Used& used) const {
  using Constant = std::array<double, 3>;
  Constant relative{}, relative_weights{}, logs{}, clipped{}, shown{}, symmetric{}, median{};
  double all = 0;
  for (const std::size_t i : used) all += weight(i);
  for (std::size_t c = 0; c < 3; ++c) {
    for (const std::size_t i : used) {
      const double t = truth(c, i), share = weight(i) / all, w = share / (t * t + kLightFloor);
      relative[c] += w * t, relative_weights[c] += w, logs[c] += share * std::log(t + kLightFloor);
      clipped[c] += share * std::min(t, 1.0), shown[c] += share * shown_value(t);
    }
    relative[c] /= relative_weights[c], logs[c] = std::exp(logs[c]) - kLightFloor;
    shown[c] = std::pow(shown[c], kShownGamma);
    symmetric[c] = best_by_smape(c, used), median[c] = quantiles(c, used, 1)[0];
  }
  const auto of = [&](const Constant& y) { return error_of([&](std::size_t c, std::size_t) { return y[c]; }, used); };
  RadianceError error = of(relative);
  error.log_rmse = of(logs).log_rmse, error.psnr = of(clipped).psnr, error.shown_psnr = of(shown).shown_psnr;
  error.smape = of(symmetric).smape, error.median_log = of(median).median_log;
  return error;
}

/// The least sum is at a truth: between two neighbouring ones terms of truths above fall, with slopes that shrink more
/// slowly than those of the terms that rise, so the sum may turn from rising to falling there, but not back.
double KnownRays::best_by_smape(std::size_t channel, const Used& used) const {
  constexpr int candidates = 256;
  double best = 0, least = std::numeric_limits<double>::infinity();
  for (const double y : quantiles(channel, used, candidates)) {
    double sum = 0;
    for (const std::size_t i : used) sum += weight(i) * symmetric_error(y, truth(channel, i));
    if (sum < least) least = sum, best = y;
  }
  return best;
}

std::vector<double> KnownRays::quantiles(std::size_t channel, const Used& used, int count) const {
  std::vector<double> values, weights, shares;
  for (const std::size_t i : used) values.push_back(truth(channel, i)), weights.push_back(weight(i));
  for (int k = 0; k < count; ++k) shares.push_back((k + 0.5) / count);
  return weighted_quantiles(values, weights, shares);
}

double KnownRays::noise(const std::vector<float>& variance, const Used& used) const {
  double relative = 0, weights = 0;
  for (const std::size_t i : used) {
    for (std::size_t c = 0; c < 3; ++c)
      relative +=
          weight(i) * static_cast<double>(variance[c * truth_.size() + i]) / (truth(c, i) * truth(c, i) + kLightFloor);
    weights += 3 * weight(i);
  }
  return relative / weights;
}

double KnownRays::angle(const std::vector<float>& planar, const Used& used) const {
  double angles = 0, weights = 0;
  for (const std::size_t i : used) {
    double dot = 0, ours = 0, theirs = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto y = static_cast<double>(planar[c * truth_.size() + i]);
      dot += y * truth(c, i), ours += y * y, theirs += truth(c, i) * truth(c, i);
    }
    const double lengths = std::sqrt(ours * theirs);
    angles += weight(i) * (lengths > 0 ? std::acos(std::clamp(dot / lengths, -1.0, 1.0)) : std::numbers::pi / 2);
    weights += weight(i);
  }
  return angles / weights * 180 / std::numbers::pi;
}

double log_intensity_range(const std::vector<float>& planar, const std::vector<double>& weights) {
  const std::size_t count = weights.size();
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = luminance(planar[i], planar[count + i], planar[2 * count + i]);
  return std::log((weighted_quantile(values, weights, 0.99) + kLightFloor) /
                  (weighted_quantile(values, weights, 0.01) + kLightFloor));
}

double way_gone(double simple, double ours, double noise) {
  return simple > noise ? (simple - ours) / (simple - noise) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace clerestory
