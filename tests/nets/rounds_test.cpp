// Rounds of samples of a picture that is noise: what is measured is the error that it has, over the pixels judged.
#include "nets/rounds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = 60, kHeight = 40;

/// Everywhere 1; samples with a deviation of 1 in the left half, of 30 in the right.
struct Noise {
  std::mt19937_64 random{7};
  RoundPicture all{Image(kWidth, kHeight, 3), {}};
  int taken = 0;
  std::uint32_t rounds = 0;

  RoundPicture take(int samples, std::uint32_t round) {
    EXPECT_EQ(round, rounds++);
    std::normal_distribution<double> normal(0, 1 / std::sqrt(samples));
    for (std::size_t i = 0; i < all.picture.data.size(); ++i) {
      const double deviation = i % kWidth < kWidth / 2 ? 1 : 30;
      const double value = 1 + deviation * normal(random);
      all.picture.data[i] = static_cast<float>((taken * all.picture.data[i] + samples * value) / (taken + samples));
    }
    taken += samples;
    return all;
  }
  double had() const {
    Image off = all.picture;
    for (float& v : off.data) v -= 1;
    return root_relative(off, all);
  }
};

TEST(Rounds, MeasureTheErrorOfAllSamplesOverThePixelsThatAreJudged) {
  Noise noise;
  for (int i = 0; i < kWidth * kHeight; ++i) noise.all.judged.push_back(i % kWidth < kWidth / 2);
  const auto rounds =
      take_rounds({.error = 0.05}, 16, [&](int samples, std::uint32_t round) { return noise.take(samples, round); });
  EXPECT_TRUE(std::isnan(rounds[0].error));
  for (std::size_t k = 1; k < rounds.size(); ++k) {
    const int before = rounds[k - 1].spp, more = rounds[k].spp - before;
    EXPECT_EQ(more % 16, 0);
    EXPECT_LE(more, before);
    EXPECT_GE(2 * more, before);
    EXPECT_EQ(rounds[k].error <= 0.05, k + 1 == rounds.size());
  }
  EXPECT_EQ(rounds.back().spp, noise.taken);
  EXPECT_GE(noise.taken, 380) << "1 / 0.05^2";
  EXPECT_LE(noise.taken, 640) << "one round too many at most";
  // Mean squares of 3,600 values are good to 2.4 %, their roots to 1.2 %: five deviations of a ratio of two.
  EXPECT_NEAR(rounds.back().error / noise.had(), 1, 0.085);
}

TEST(Rounds, WithoutAPixelToBeJudgedAllAre) {
  Noise noise;
  noise.all.judged.assign(kWidth * kHeight, false);
  const auto rounds =
      take_rounds({.seconds = 1e-9}, 32, [&](int samples, std::uint32_t round) { return noise.take(samples, round); });
  ASSERT_EQ(rounds.size(), 2u) << "one round knows no error";
  EXPECT_EQ(rounds[1].spp, 64);
  EXPECT_GT(rounds[1].error, 1) << "the right half is in it";
}

// Users average pictures of seeds 0, 1, 2...: none of their samples may be another's.
TEST(Rounds, OfNeighbouringSeedsShareNoSamples) {
  std::set<std::uint32_t> seen;
  for (std::uint32_t seed = 0; seed < 100; ++seed)
    for (std::uint32_t round = 0; round < 12; ++round) EXPECT_TRUE(seen.insert(round_seed(seed, round)).second);
  EXPECT_EQ(round_seed(7, 0), 7u) << "a picture without rounds is the first one's";
}

TEST(Rounds, AFirstOneThatLeavesNoSecondIsRefused) {
  RenderSettings settings;
  for (const int spp : {16, 8192}) {
    settings.spp = spp;
    check_goal(settings, {.error = 0.1});
  }
  for (const int spp : {0, 8, 8208, 16384}) {
    settings.spp = spp;
    EXPECT_THROW(check_goal(settings, {.error = 0.1}), Error) << spp;
    EXPECT_THROW(check_goal(settings, {.seconds = 1}), Error) << spp;
  }
}

}  // namespace
}  // namespace clerestory
