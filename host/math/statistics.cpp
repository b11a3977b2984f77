#include "host/math/statistics.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"

namespace clerestory {
namespace {

template <class T>
double sum_of(std::span<const T> values) {
  CompensatedSum total;
  for (T v : values) total.add(v);
  return total.value();
}

void check_not_empty(std::size_t count) {
  if (count == 0) throw usage_error("no values", "statistics", "0", "at least 1");
}

template <class T>
double mean_of(std::span<const T> values) {
  check_not_empty(values.size());
  return sum_of(values) / static_cast<double>(values.size());
}

template <class T>
double quantile_of(std::span<const T> values, double q) {
  check_not_empty(values.size());
  if (!(q >= 0 && q <= 1)) throw usage_error("quantile out of range", "statistics", fmt::format("{}", q), "0 to 1");
  std::vector<T> sorted(values.begin(), values.end());
  if (std::any_of(sorted.begin(), sorted.end(), [](T v) { return std::isnan(v); }))
    throw usage_error("quantile of values with NaN", "statistics");
  const double position = q * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<std::size_t>(position);
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(low);
  std::nth_element(sorted.begin(), at, sorted.end());
  const double below = *at, fraction = position - static_cast<double>(low);
  if (fraction == 0) return below;
  const double above = *std::min_element(at + 1, sorted.end());
  return below + fraction * (above - below);
}

template <class T>
double deviation_of(std::span<const T> values) {
  const double centre = mean_of(values);
  if (values.size() == 1) return 0;
  CompensatedSum squares;
  for (T v : values) squares.add((v - centre) * (v - centre));
  return std::sqrt(squares.value() / static_cast<double>(values.size() - 1));
}

}  // namespace

void CompensatedSum::add(double value) {
  const double next = sum_ + value;
  // The part of the smaller addend that was lost in rounding.
  compensation_ += std::abs(sum_) >= std::abs(value) ? (sum_ - next) + value : (value - next) + sum_;
  sum_ = next;
}

double sum(std::span<const float> values) { return sum_of(values); }
double sum(std::span<const double> values) { return sum_of(values); }
double mean(std::span<const float> values) { return mean_of(values); }
double mean(std::span<const double> values) { return mean_of(values); }
double quantile(std::span<const float> values, double q) { return quantile_of(values, q); }
double quantile(std::span<const double> values, double q) { return quantile_of(values, q); }
double median(std::span<const float> values) { return quantile_of(values, 0.5); }
double median(std::span<const double> values) { return quantile_of(values, 0.5); }
double standard_deviation(std::span<const float> values) { return deviation_of(values); }
double standard_deviation(std::span<const double> values) { return deviation_of(values); }

double luminance_quantile(std::span<const float> rgb, double q) {
  if (rgb.size() % 3 != 0)
    throw usage_error("not a picture of three channels", "luminance", fmt::format("{} values", rgb.size()));
  const std::size_t pixels = rgb.size() / 3;
  std::vector<float> values(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    values[i] = static_cast<float>(luminance(rgb[i], rgb[pixels + i], rgb[2 * pixels + i]));
  return quantile(values, q);
}

double exposure_of(std::span<const float> rgb) {
  const double bright = luminance_quantile(rgb, 0.95);
  return bright > 0 ? 0.9 / bright : 1;
}

double scene_scale(std::span<const float> depth, const std::string& where) {
  std::vector<float> valid;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(valid),
               [](float d) { return d > 0 && std::isfinite(d); });
  if (valid.empty())
    throw usage_error("no valid depth", where, "0 of " + std::to_string(depth.size()) + " pixels", "positive metres");
  return quantile(valid, 0.99);
}

ChiSquareTest chi_square_test(std::span<const double> observed, std::span<const double> expected, double least) {
  if (observed.size() != expected.size())
    throw usage_error("unlike numbers of cells", "chi_square_test",
                      fmt::format("{} observed, {} expected", observed.size(), expected.size()));
  ChiSquareTest test;
  CompensatedSum statistic, pool_observed, pool_expected;
  int cells = 0;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (!(expected[i] >= 0))
      throw usage_error("an expected count is negative", "chi_square_test", fmt::format("{}", expected[i]));
    if (expected[i] < least) {
      pool_observed.add(observed[i]), pool_expected.add(expected[i]), ++test.pooled;
      continue;
    }
    const double difference = observed[i] - expected[i];
    statistic.add(difference * difference / expected[i]), ++cells;
  }
  if (pool_expected.value() > 0) {
    const double difference = pool_observed.value() - pool_expected.value();
    statistic.add(difference * difference / pool_expected.value()), ++cells;
  } else if (pool_observed.value() > 0) {
    test.p_value = 0;  // the impossible was observed
  }
  test.statistic = statistic.value(), test.degrees = cells - 1;
  if (test.p_value > 0 && test.degrees > 0) test.p_value = chi_square_p_value(test.statistic, test.degrees);
  return test;
}

double sidak_significance(double alpha, double tests) { return -std::expm1(std::log1p(-alpha) / tests); }

}  // namespace clerestory
