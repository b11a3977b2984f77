// Intervals of differences against what they promise, on errors whose truth is known.
#include "host/math/bootstrap.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/error.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

constexpr int kRooms = 20;

/// Errors of a side: a room's own, which both sides share, what a seed adds to all rooms, and noise.
struct Rooms {
  explicit Rooms(std::mt19937_64& source) : random(source) {
    for (int r = 0; r < kRooms; ++r) hard.push_back(10 + 5 * normal(random));
  }
  Repeated side(int seeds, double offset, double seed_spread) {
    Repeated all;
    for (int s = 0; s < seeds; ++s) {
      const double own = seed_spread * normal(random);
      std::vector<double>& one = all.emplace_back();
      for (const double h : hard) one.push_back(h + offset + own + 0.5 * normal(random));
    }
    return all;
  }
  std::mt19937_64& random;
  std::normal_distribution<double> normal;
  std::vector<double> hard;
};

/// How often the interval misses the true difference.
double misses(int seeds, double seed_spread, double other_spread) {
  constexpr int kTrials = 1000;
  std::mt19937_64 source(7);
  int missed = 0;
  for (int t = 0; t < kTrials; ++t) {
    Rooms rooms(source);
    const Repeated mine = rooms.side(seeds, 0.25, seed_spread), other = rooms.side(seeds, 0, other_spread);
    const Difference d = paired_bootstrap(mine, other, static_cast<std::uint64_t>(t), 400);
    missed += d.low > 0.25 || d.high < 0.25;
  }
  return static_cast<double>(missed) / kTrials;
}

TEST(Bootstrap, IntervalsHoldTheTruthAsOftenAsTheySay) {
  // Of 1000 intervals 50 +- 6.9 may miss; 2.5 % to 7.5 % is 3.6 deviations. Departures that are not widened miss four
  // times as often with two seeds, and those of one spread for both sides three times where one spreads ten times more:
  // Welch's t misses 6.2 of a hundred there, for two seeds (200,000 draws of normal numbers), and 9 is 3.7 deviations.
  for (const int seeds : {2, 3, 5}) {
    EXPECT_NEAR(misses(seeds, 1, 1), 0.05, 0.025) << seeds << " seeds that differ";
    EXPECT_LE(misses(seeds, 2, 0.2), 0.09) << seeds << " seeds that differ on one side";
    EXPECT_LE(misses(seeds, 0, 0), 0.075) << seeds << " seeds alike: noise counts in rooms and in seeds";
  }
  EXPECT_NEAR(misses(1, 0, 0), 0.05, 0.025);
}

TEST(Bootstrap, WhatBothShareIsNoDifference) {
  std::mt19937_64 source(1);
  Rooms rooms(source);  // which are five apart: means of twenty differ by three between draws that are not paired
  const Repeated mine = rooms.side(4, 0, 0);
  Repeated other = mine;
  for (auto& one : other)
    for (double& v : one) v += 1;
  const Difference d = paired_bootstrap(mine, other, 3);
  EXPECT_NEAR(d.mean, -1, 1e-13);
  EXPECT_TRUE(d.clear());
  EXPECT_LT(d.high - d.low, 1) << "the spread over rooms is not in it";
  EXPECT_FALSE(paired_bootstrap(mine, mine, 3).clear());
}

TEST(Bootstrap, OneSeedHasRoomsAlone) {
  const Repeated mine{{1, 2, 3, 4}}, other{{0, 1, 2, 3}};
  const Difference d = paired_bootstrap(mine, other, 1);
  EXPECT_EQ(d.low, 1);
  EXPECT_EQ(d.high, 1);
  const Repeated two{{1, 2, 3, 4}, {9, 9, 9, 9}};
  EXPECT_EQ(paired_bootstrap(two, {two[0]}, 1).mean, 3.25);
}

TEST(Bootstrap, IsTheSameEachTime) {
  std::mt19937_64 source(2);
  Rooms rooms(source);
  const Repeated mine = rooms.side(3, 1, 1), other = rooms.side(2, 0, 1);
  const Difference a = paired_bootstrap(mine, other, 5), b = paired_bootstrap(mine, other, 5);
  EXPECT_EQ(a.low, b.low);
  EXPECT_EQ(a.high, b.high);
  EXPECT_NE(paired_bootstrap(mine, other, 6).low, a.low);
}

TEST(Bootstrap, RefusesUnlikeQuestions) {
  EXPECT_THAT(message_of(
                  [] {
                    paired_bootstrap({{1, 2}}, {{1, 2, 3}}, 1);
                  },
                  ErrorKind::Usage),
              testing::HasSubstr("unlike numbers"));
  EXPECT_THAT(message_of([] { paired_bootstrap({{1}}, {{1}}, 1); }, ErrorKind::Usage),
              testing::HasSubstr("at least 2"));
  EXPECT_THAT(message_of(
                  [] {
                    paired_bootstrap({}, {{1, 2}}, 1);
                  },
                  ErrorKind::Usage),
              testing::HasSubstr("no repetition"));
}

}  // namespace
}  // namespace clerestory
