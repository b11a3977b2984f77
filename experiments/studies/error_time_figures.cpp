#include "experiments/studies/error_time_figures.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

/// The mean of products of unlike runs: an estimate of the square of their expectation without their noise.
double product_of_unlike(double sum, double squares, double runs) {
  return (sum * sum - squares) / (runs * (runs - 1));
}

double squared_standard_error(const std::vector<double>& values) {
  return std::pow(standard_deviation(values), 2) / static_cast<double>(values.size());
}

void check_runs(const std::vector<Estimate>& runs, std::size_t size, const char* what) {
  if (runs.size() < 2) throw Error(ErrorKind::Failed, "an unbiased square takes two runs", what);
  for (const Estimate& run : runs)
    if (run.size() != size) throw Error(ErrorKind::Failed, "estimates of unlike sizes", what);
}

}  // namespace

ErrorReference::ErrorReference(const std::vector<Estimate>& runs, std::vector<bool> used, std::optional<double> floor)
    : used_(std::move(used)) {
  const std::size_t size = runs.empty() ? 0 : runs[0].size();
  check_runs(runs, size, "reference");
  const auto count = static_cast<double>(runs.size());
  mean_.resize(size), square_.resize(size), weight_.resize(size);
  CompensatedSum all, values;
  for (std::size_t i = 0; i < size; ++i) {
    double sum = 0, squares = 0;
    for (const Estimate& run : runs) sum += run[i], squares += run[i] * run[i];
    mean_[i] = sum / count, square_[i] = product_of_unlike(sum, squares, count);
    if (!used_[i % used_.size()]) continue;
    all.add(square_[i]), values.add(1);
  }
  if (values.value() == 0 || (!floor && all.value() <= 0))
    throw Error(ErrorKind::Failed, "nothing to compare with", "reference");
  for (std::size_t i = 0; i < size; ++i)
    if (used_[i % used_.size()])
      weight_[i] = 1 / (floor ? (mean_[i] * mean_[i] + *floor) * values.value() : all.value());
  for (const Estimate& run : runs) sums_.push_back(sum_of(run));
}

double ErrorReference::sum_of(const Estimate& estimate) const {
  CompensatedSum sum;
  for (std::size_t i = 0; i < weight_.size(); ++i) sum.add(std::sqrt(weight_[i]) * estimate[i]);
  return sum.value();
}

double ErrorReference::error(const Estimate& estimate) const {
  CompensatedSum sum;
  for (std::size_t i = 0; i < mean_.size(); ++i)
    if (weight_[i] > 0) sum.add(weight_[i] * (estimate[i] * (estimate[i] - 2 * mean_[i]) + square_[i]));
  return sum.value();
}

double ErrorReference::stated(const Estimate& standard_errors) const {
  CompensatedSum sum;
  for (std::size_t i = 0; i < weight_.size(); ++i) sum.add(weight_[i] * standard_errors[i] * standard_errors[i]);
  return sum.value();
}

ErrorReference::Moments ErrorReference::moments(const std::vector<Estimate>& estimates) const {
  check_runs(estimates, mean_.size(), "estimates");
  const auto count = static_cast<double>(estimates.size());
  std::vector<double> bias_of_pixel(used_.size());
  Moments found;
  for (std::size_t i = 0; i < mean_.size(); ++i) {
    if (weight_[i] == 0) continue;
    double sum = 0, squares = 0;
    for (const Estimate& e : estimates) sum += e[i], squares += e[i] * e[i];
    const double square = product_of_unlike(sum, squares, count);
    bias_of_pixel[i % used_.size()] += weight_[i] * (square - 2 * sum / count * mean_[i] + square_[i]);
    found.variance += weight_[i] * (squares / count - square);
  }
  for (const double bias : bias_of_pixel) found.bias += bias, found.bias_spread += bias * bias;
  std::vector<double> sums;
  for (const Estimate& e : estimates) sums.push_back(sum_of(e));
  found.shift = clerestory::mean(sums) - clerestory::mean(sums_);
  found.shift_spread = squared_standard_error(sums), found.truth_spread = squared_standard_error(sums_);
  return found;
}

std::optional<double> p_together(const std::vector<std::optional<double>>& tests) {
  double statistic = 0;
  for (const std::optional<double>& p : tests) {
    if (!p) return {};
    if (*p <= 0) return 0;
    statistic -= 2 * std::log(*p);
  }
  return chi_square_p_value(statistic, 2 * static_cast<double>(tests.size()));
}

std::optional<double> log_log_slope(const std::vector<double>& x, const std::vector<double>& y) {
  if (!std::ranges::all_of(y, [](double one) { return std::isfinite(one); })) return {};
  std::vector<double> u, v;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (x[i] > 0 && y[i] > 0) u.push_back(std::log(x[i])), v.push_back(std::log(y[i]));
  if (u.size() < 2) return {};
  const double mean_u = mean(u), mean_v = mean(v);
  double uv = 0, uu = 0;
  for (std::size_t i = 0; i < u.size(); ++i)
    uv += (u[i] - mean_u) * (v[i] - mean_v), uu += (u[i] - mean_u) * (u[i] - mean_u);
  return uu > 0 ? std::optional(uv / uu) : std::nullopt;
}

std::vector<bool> pareto_front(const std::vector<double>& seconds, const std::vector<double>& error) {
  std::vector<bool> front;
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    bool beaten = !std::isfinite(error[i]);
    for (std::size_t k = 0; k < seconds.size(); ++k)
      beaten = beaten ||
               (seconds[k] <= seconds[i] && error[k] <= error[i] && (seconds[k] < seconds[i] || error[k] < error[i]));
    front.push_back(!beaten);
  }
  return front;
}

Cell seconds_to(double error, const std::vector<double>& seconds, const std::vector<double>& errors) {
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!(errors[i] <= error)) continue;  // one that is no number reaches nothing
    if (i == 0) return fmt::format("< {:.2g}", seconds[0]);
    if (errors[i] <= 0) return fmt::format("< {:.2g}", seconds[i]);  // by chance; its logarithm says nothing
    const double along = std::log(errors[i - 1] / error) / std::log(errors[i - 1] / errors[i]);
    return Measure{seconds[i - 1] * std::pow(seconds[i] / seconds[i - 1], along)};
  }
  return fmt::format("> {:.2g}", seconds.back());
}

Cell factor_of(const Cell& plain, const Cell& other) {
  struct Bounded {
    double seconds;
    int above;  // 1: more than these, -1: less
  };
  const auto read = [](const Cell& cell) {
    if (const auto* measure = std::get_if<Measure>(&cell)) return Bounded{measure->mean, 0};
    const std::string& text = std::get<std::string>(cell);  // "> 0.43"
    return Bounded{std::stod(text.substr(2)), text[0] == '>' ? 1 : -1};
  };
  const Bounded a = read(plain), b = read(other);
  const double factor = a.seconds / b.seconds;
  if (a.above == 0 && b.above == 0) return Measure{factor};
  if (a.above * b.above > 0) return {};  // both more, or both less
  return fmt::format("{} {:.2g}", a.above - b.above > 0 ? '>' : '<', factor);
}

}  // namespace clerestory
