// Intervals over rooms against what the normal distribution says of means, and what is left out.
#include "experiments/studies/intervals.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace clerestory {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Independent draws of the normal distribution around `mean`.
std::vector<double> draws(std::size_t rooms, double mean, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(mean, 1);
  std::vector<double> all;
  for (std::size_t r = 0; r < rooms; ++r) all.push_back(normal(random));
  return all;
}

TEST(Intervals, OfManyRoomsAreThoseOfTheNormalDistribution) {
  const std::vector<double> rooms = draws(400, 5, 1);
  double mean = 0, square = 0;
  for (const double v : rooms) mean += v / 400, square += v * v / 400;
  const double half = 1.96 * std::sqrt((square - mean * mean) / 400);
  const auto interval = interval_over(rooms);
  ASSERT_TRUE(interval);
  EXPECT_NEAR(interval->mean, mean, 1e-12);
  // An end is a quantile of 4,000 draws: it scatters by some 4 % of the half width.
  EXPECT_NEAR(interval->low, mean - half, 0.15 * half);
  EXPECT_NEAR(interval->high, mean + half, 0.15 * half);
  const Measure shown = std::get<Measure>(with_interval(rooms));
  EXPECT_EQ(shown.mean, interval->mean);
  EXPECT_NEAR(shown.deviation, half, 0.1 * half);
  EXPECT_EQ(shown.count, 400);
}

TEST(Intervals, LeaveOutWhatIsNotFinite) {
  const auto interval = interval_over({1, kNone, 3, INFINITY});
  ASSERT_TRUE(interval);
  EXPECT_EQ(interval->mean, 2);
  // Two rooms 1 off their mean: a standard deviation of sqrt(2), and Student's t of one degree of freedom, 12.7062.
  const double half = std::sqrt(2) * 12.7062 / 1.95996;
  EXPECT_NEAR(interval->low, 2 - half, 1e-3);
  EXPECT_NEAR(interval->high, 2 + half, 1e-3);
  EXPECT_FALSE(interval_over({1, kNone}));
  EXPECT_FALSE(interval_over({}));
  const Measure one = std::get<Measure>(with_interval({kNone, 7}));
  EXPECT_EQ(one.mean, 7);
  EXPECT_EQ(one.deviation, 0);
  EXPECT_EQ(with_interval({kNone}).index(), 0u);
  EXPECT_EQ(with_interval({}).index(), 0u);
}

TEST(Intervals, VerdictsNeedAnIntervalClearOfNothing) {
  const std::vector<double> base = draws(50, 5, 2), like = draws(50, 5, 3);
  std::vector<double> better = base;
  for (std::size_t r = 0; r < 50; ++r) better[r] += 0.2 + 0.1 * (like[r] - 5);  // rooms scatter more than that
  const auto clear = roomwise_difference(better, base);
  ASSERT_TRUE(clear);
  EXPECT_EQ(clear->verdict, "higher") << "rooms are compared with themselves";
  EXPECT_EQ(roomwise_difference(base, better)->verdict, "lower");
  EXPECT_NEAR(clear->mean + roomwise_difference(base, better)->mean, 0, 1e-12);
  EXPECT_EQ(roomwise_difference(base, like)->verdict, "none");
  EXPECT_EQ(roomwise_difference(base, base)->verdict, "none");
  EXPECT_EQ(roomwise_difference(base, base)->interval->low, 0);
  EXPECT_EQ(roomwise_difference(base, base)->interval->high, 0);
}

TEST(Intervals, ATableShowsTheIntervalThatTheVerdictIsOf) {
  // One room far off: the mean less half the interval lies below 0, the interval above it.
  std::vector<double> mine(30, 0.1);
  mine.back() = 6;
  const std::vector<double> other(mine.size(), 0.0);
  const auto d = roomwise_difference(mine, other);
  ASSERT_TRUE(d && d->interval);
  EXPECT_EQ(d->verdict, "higher");
  EXPECT_LT(d->mean - 0.5 * (d->interval->high - d->interval->low), 0);
  Table table{"Differences", {{"less"}}, {}};
  add_difference_columns(table, "dB", "it is");
  std::vector<Cell> row{"other"};
  add_difference(row, *d);
  table.add(row);
  EXPECT_EQ(table.columns[2].name, "from");
  EXPECT_EQ(std::get<Measure>(row[1]).mean, d->mean);
  EXPECT_EQ(std::get<Measure>(row[2]).mean, d->interval->low);
  EXPECT_EQ(std::get<Measure>(row[3]).mean, d->interval->high);
  EXPECT_EQ(std::get<std::string>(row[4]), "higher");
}

TEST(Intervals, DifferencesAreOfRoomsThatBothHave) {
  const auto one = roomwise_difference({1, kNone, 3}, {kNone, 2, 1});
  ASSERT_TRUE(one);
  EXPECT_EQ(one->mean, 2);
  EXPECT_EQ(one->verdict, "one room");
  EXPECT_FALSE(roomwise_difference({1, kNone}, {kNone, 1}));
}

}  // namespace
}  // namespace clerestory
