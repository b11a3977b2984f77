// Skies made by rules: units, what a sky must show, and that a seed's stays as it is.
#include "tracer/sky.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tests/roundings.hpp"

namespace clerestory {
namespace {

float luminance(const Panorama& p, int x, int y) {
  const float* c = &p.rgb[3 * (static_cast<std::size_t>(y) * p.width + x)];
  return 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2];
}

TEST(Sky, HasMeanOneAndNothingNegative) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Panorama p = make_sky(seed);
    ASSERT_EQ(p.rgb.size(), 3u * p.width * p.height);
    const double mean = std::accumulate(p.rgb.begin(), p.rgb.end(), 0.0) / static_cast<double>(p.rgb.size());
    EXPECT_NEAR(mean, 1, 2 * kFloatRounding) << seed;  // of the scale, and of each value
    for (const float v : p.rgb) ASSERT_TRUE(std::isfinite(v) && v >= 0) << seed;
  }
}

TEST(Sky, ClearOnesHaveASunAndAreBlueOvercastOnesNeither) {
  int suns = 0, grey = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Panorama p = make_sky(seed);
    float most = 0;
    for (int y = 0; y < p.height; ++y)
      for (int x = 0; x < p.width; ++x) most = std::max(most, luminance(p, x, y));
    EXPECT_LT(most, 2000) << "a sun that no number of samples resolves";
    float blue = 0;  // of the bluest part of the upper half
    for (std::size_t i = 0; i < p.rgb.size() / 4; i += 3) blue = std::max(blue, p.rgb[i + 2] / p.rgb[i]);
    suns += most > 40;
    // Moon and Spencer: the zenith is three times as bright as the horizon, and hardly coloured.
    if (most < 10 && blue < 1.15f) ++grey;
    if (most > 100) {
      EXPECT_GT(blue, 1.3f) << seed;
    }
  }
  EXPECT_GT(suns, 12);
  EXPECT_GT(grey, 10);
}

TEST(Sky, SunnyOnesHaveAStrongSunWhereTheySay) {
  int suns = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Panorama p = make_sunny_sky(seed);
    int brightest = 0;
    double all = 0, sun = 0;
    for (int i = 0; i < p.width * p.height / 2; ++i) {
      const int x = i % p.width, y = i / p.width;
      const double weight = std::sin((y + 0.5) / p.height * std::numbers::pi) * static_cast<double>(luminance(p, x, y));
      if (luminance(p, x, y) > luminance(p, brightest % p.width, brightest / p.width)) brightest = i;
      all += weight;
      if (luminance(p, x, y) > 100) sun += weight;
    }
    if (luminance(p, brightest % p.width, brightest / p.width) < 100) continue;  // behind a house
    ++suns;
    const double x = (brightest % p.width + 0.5) / p.width, from_zenith = (brightest / p.width + 0.5) / p.height;
    if (from_zenith < 1.0 / 3) {  // low ones shine through much air
      EXPECT_GT(sun, 0.1 * all) << seed;
    }
    const double off =
        std::remainder((x - 0.5) * 2 * std::numbers::pi - static_cast<double>(sun_azimuth(seed)), 2 * std::numbers::pi);
    // The disc's radius and a pixel.
    EXPECT_LT(std::abs(off) * std::sin(from_zenith * std::numbers::pi),
              (1.6 + 360.0 / p.width) * std::numbers::pi / 180)
        << seed;
  }
  EXPECT_GE(suns, 10);
}

TEST(Sky, GroundIsDarkerThanSky) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Panorama p = make_sky(seed);
    double above = 0, below = 0;
    for (int x = 0; x < p.width; ++x)
      above += static_cast<double>(luminance(p, x, 12)), below += static_cast<double>(luminance(p, x, p.height - 12));
    EXPECT_LT(below, above) << seed;
  }
}

double golden_sum(const Panorama& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.rgb.size(); ++i)
    sum += std::sin(static_cast<double>(i)) * std::sqrt(static_cast<double>(p.rgb[i]));
  return sum;
}

// Room files name skies by their seeds. As they were when the first did; another C library may round sines otherwise.
TEST(Sky, OfASeedIsWhatItAlwaysWas) {
  const double sums[] = {0.5172, 0.4276, 4.7504, -0.4024}, sunny[] = {14.4727, -16.4481, -19.5994, 128.4736};
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {  // 1e5 floats, three roundings each, all one way
    EXPECT_NEAR(golden_sum(make_sky(seed)), sums[seed - 1], 1e-2) << seed;
    EXPECT_NEAR(golden_sum(make_sunny_sky(seed)), sunny[seed - 1], 1e-2) << seed;
  }
}

TEST(Sky, NamesHoldTheirSeeds) {
  for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{77}, ~std::uint64_t{0}}) {
    EXPECT_EQ(sky_seed(sky_name(seed)), seed);
    EXPECT_EQ(sunny_seed(sunny_name(seed)), seed);
    EXPECT_EQ(sky_seed(sunny_name(seed)), std::nullopt);
  }
  for (const char* name : {"park", "sky-", "sky-1", "sky-00000000000000zz", "sky-00000000000000001"})
    EXPECT_EQ(sky_seed(name), std::nullopt) << name;
}

}  // namespace
}  // namespace clerestory
