#include "host/math/bootstrap.hpp"

#include <cmath>
#include <random>

#include "host/error.hpp"
#include "host/math/statistics.hpp"
#include "host/math/welch.hpp"

namespace clerestory {
namespace {

using Numbers = std::vector<double>;

constexpr double kShare = 0.95;
constexpr double kNormalLimit = 1.959963984540054;  // what holds that share of a normal distribution

void check(const Repeated& mine, const Repeated& other) {
  for (const Repeated* side : {&mine, &other})
    if (side->empty()) throw usage_error("no repetition", "paired_bootstrap", "0", "at least 1");
  const std::size_t questions = mine[0].size();
  for (const Repeated* side : {&mine, &other})
    for (const Numbers& one : *side)
      if (one.size() != questions || questions < 2)
        throw usage_error("unlike numbers of questions", "paired_bootstrap", fmt::format("{}", one.size()),
                          fmt::format("{}, at least 2", questions));
}

/// Means over repetitions.
Numbers by_question(const Repeated& side) {
  Numbers means;
  for (std::size_t q = 0; q < side[0].size(); ++q) {
    Numbers all;
    for (const Numbers& one : side) all.push_back(one[q]);
    means.push_back(mean(all));
  }
  return means;
}

Numbers by_repetition(const Repeated& side) {
  Numbers means;
  for (const Numbers& one : side) means.push_back(mean(one));
  return means;
}

/// Departures from the mean, as wide as their draws with replacement have to be: those of n are short of the variance
/// by (n - 1) / n, and Student's t is wider than a normal distribution.
Numbers departures(const Numbers& values) {
  const auto n = static_cast<double>(values.size());
  const double wider =
      std::sqrt(n / (n - 1)) * student_limit(kShare, static_cast<int>(values.size()) - 1) / kNormalLimit;
  const double centre = mean(values);
  Numbers all;
  for (const double v : values) all.push_back(wider * (v - centre));
  return all;
}

/// What chance does to the difference of two means of a few draws each, by Student's t; no error where a side has one
/// draw.
ErrorOfSum chance_of(const Numbers& mine, const Numbers& other) {
  if (mine.size() < 2 || other.size() < 2) return {};
  const auto square = [](const Numbers& side) {
    return std::pow(standard_deviation(side), 2) / static_cast<double>(side.size());
  };
  const auto count = [](const Numbers& side) { return static_cast<std::int64_t>(side.size()); };
  return error_of_sum({{0, {square(mine), square(other)}, {count(mine), count(other)}}}).value_or(ErrorOfSum{});
}

/// The mean of as many, drawn with replacement.
double drawn_mean(const Numbers& values, std::mt19937_64& random) {
  CompensatedSum total;
  for (std::size_t i = 0; i < values.size(); ++i)
    total.add(values[(random() >> 11) % values.size()]);  // 2^53 is so much more that no one is favoured
  return total.value() / static_cast<double>(values.size());
}

}  // namespace

Difference paired_bootstrap(const Repeated& mine, const Repeated& other, std::uint64_t seed, int draws) {
  check(mine, other);
  const Numbers a = by_question(mine), b = by_question(other);
  Numbers paired;
  for (std::size_t q = 0; q < a.size(); ++q) paired.push_back(a[q] - b[q]);
  const double middle = mean(paired);
  const Numbers questions = departures(paired);
  const ErrorOfSum chance = chance_of(by_repetition(mine), by_repetition(other));
  std::mt19937_64 random(seed);
  std::student_t_distribution<double> student(chance.degrees);
  Numbers drawn;
  for (int i = 0; i < draws; ++i)
    drawn.push_back(middle + drawn_mean(questions, random) + chance.error * student(random));
  return {middle, quantile(drawn, (1 - kShare) / 2), quantile(drawn, (1 + kShare) / 2)};
}

}  // namespace clerestory
