#include "experiments/evaluation/light_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

/// The value at which the running sum of weights reaches a share of it. `order` sorts `values`.
double weighted_quantile(const std::vector<double>& values, const std::vector<double>& weights,
                         const std::vector<std::size_t>& order, double q) {
  const double wanted = q * sum(weights);
  double reached = 0;
  for (const std::size_t i : order)
    if ((reached += weights[i]) >= wanted) return values[i];
  return values[order.back()];
}

}  // namespace

KnownRays::KnownRays(std::vector<std::array<float, 3>> truth, std::vector<double> weights)
    : truth_(std::move(truth)), weights_(std::move(weights)) {
  if (!weights_.empty() && weights_.size() != truth_.size())
    throw Error(ErrorKind::Failed, "rays and weights of unlike number", "light errors");
}

template <class Relative, class Logarithmic>
LightError KnownRays::error_of(const Relative& relative, const Logarithmic& logarithmic, const Used& used) const {
  double squares = 0, logs = 0, weights = 0;
  for (const std::size_t i : used) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double t = truth(c, i), d = relative(c, i) - t,
                   l = std::log((std::max(logarithmic(c, i), 0.0) + kLightFloor) / (t + kLightFloor));
      squares += weight(i) * (d * d / (t * t + kLightFloor)), logs += weight(i) * (l * l);
    }
    weights += 3 * weight(i);
  }
  return {squares / weights, std::sqrt(logs / weights), 1};
}

LightError KnownRays::error(const std::vector<float>& planar, const Used& used) const {
  const auto answer = [&](std::size_t c, std::size_t i) { return static_cast<double>(planar[c * truth_.size() + i]); };
  return error_of(answer, answer, used);
}

LightError KnownRays::best_constant(const Used& used) const {
  std::array<double, 3> weighted{}, weights{}, logs{};
  double all = 0;
  for (const std::size_t i : used) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double t = truth(c, i), w = weight(i) / (t * t + kLightFloor);
      weighted[c] += w * t, weights[c] += w, logs[c] += weight(i) * std::log(t + kLightFloor);
    }
    all += weight(i);
  }
  return error_of([&](std::size_t c, std::size_t) { return weighted[c] / weights[c]; },
                  [&](std::size_t c, std::size_t) { return std::exp(logs[c] / all) - kLightFloor; }, used);
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
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  return std::log((weighted_quantile(values, weights, order, 0.99) + kLightFloor) /
                  (weighted_quantile(values, weights, order, 0.01) + kLightFloor));
}

double gap_closed(double photo, double ours, double noise) {
  return photo > noise ? (photo - ours) / (photo - noise) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace clerestory
