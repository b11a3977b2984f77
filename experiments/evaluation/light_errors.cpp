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
  std::array<double, 3> weighted{}, weights{}, logs{};
  double all = 0;
  for (const std::size_t i : used) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double t = truth(c, i), w = weight(i) / (t * t + kLightFloor);
      weighted[c] += w * t, weights[c] += w, logs[c] += weight(i) * std::log(t + kLightFloor);
    }
    all += weight(i);
  }
  RadianceError error =
      error_of([&](std::size_t c, std::size_t) { return std::exp(logs[c] / all) - kLightFloor; }, used);
  error.relmse = error_of([&](std::size_t c, std::size_t) { return weighted[c] / weights[c]; }, used).relmse;
  return error;
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
