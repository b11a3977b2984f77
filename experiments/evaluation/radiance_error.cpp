#include "experiments/evaluation/radiance_error.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

double decibels(double mean_square) { return -10 * std::log10(std::max(mean_square, 1e-12)); }
double squared(double x) { return x * x; }

}  // namespace

double shown_value(double linear) { return std::pow(std::clamp(linear, 0.0, 1.0), 1 / kShownGamma); }

double symmetric_error(double answer, double truth) {
  return std::abs(answer - truth) / (std::abs(answer) + truth + kLightFloor);
}

void RadianceError::add(const RadianceError& view) {
  relmse += view.relmse, log_rmse += view.log_rmse, smape += view.smape, psnr += view.psnr;
  shown_psnr += view.shown_psnr, median_log += view.median_log, ++views;
}

void RadianceError::divide_by_views() {
  if (views == 0) return;
  for (double* sum : {&relmse, &log_rmse, &smape, &psnr, &shown_psnr, &median_log}) *sum /= views;
}

void RadianceErrorSums::add(double answer, double truth, double weight) {
  const double l = std::log((std::max(answer, 0.0) + kLightFloor) / (truth + kLightFloor));
  relative_ += weight * relative_square(answer, truth), squared_logs_ += weight * (l * l);
  symmetric_ += weight * symmetric_error(answer, truth);
  clipped_ += weight * squared(std::min(answer, 1.0) - std::min(truth, 1.0));
  shown_ += weight * squared(shown_value(answer) - shown_value(truth));
  weight_ += weight;
  logs_.push_back(l), weights_.push_back(weight);
}

RadianceError RadianceErrorSums::error() const {
  RadianceError error = means();
  error.median_log = weighted_quantile(logs_, weights_, 0.5);
  return error;
}

RadianceError RadianceErrorSums::means() const {
  if (empty()) throw Error(ErrorKind::Failed, "no value to compare", "radiance error");
  return {relative_ / weight_,
          std::sqrt(squared_logs_ / weight_),
          symmetric_ / weight_,
          decibels(clipped_ / weight_),
          decibels(shown_ / weight_),
          0,
          1};
}

std::vector<double> weighted_quantiles(const std::vector<double>& values, const std::vector<double>& weights,
                                       const std::vector<double>& shares) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  const double all = sum(weights);
  std::vector<double> at;
  double reached = weights[order[0]];
  std::size_t i = 0;
  for (const double share : shares) {
    while (reached < share * all && i + 1 < order.size()) reached += weights[order[++i]];
    at.push_back(values[order[i]]);
  }
  return at;
}

double weighted_quantile(const std::vector<double>& values, const std::vector<double>& weights, double q) {
  return weighted_quantiles(values, weights, {q})[0];
}

}  // namespace clerestory
