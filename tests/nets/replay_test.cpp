// A sample taken again is the sample that was taken.
#include "nets/replay.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "tests/nets/corner.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

constexpr int kPixel = 14 * kCornerWidth + 21, kSpp = 20;  // the second row of samples is not full

const std::vector<double>& named(const std::vector<Quantity>& all, const std::string& name) {
  return std::ranges::find(all, name, &Quantity::name)->values;
}

struct ReplayTest : testing::Test {
  Device device = device_for(Precision::Single);
  Scene scene = corner();
  RenderSettings settings;
  ReplayTest() { settings.spp = kSpp, settings.seed = 11, settings.light = "image"; }
};

TEST_F(ReplayTest, ContributionsAddUpToThePixel) {
  for (const std::string points : {"sobol", "independent"})
    for (const bool lamp : {false, true}) {
      settings.points = points;
      settings.lamps.clear(), settings.sampler = lamp ? "guided" : "vndf_caps";
      if (lamp) settings.lamps = {{{0.5, 2.5, 0.5}, 0.6, {4, 3, 2}}};
      const Image picture = render_scene(device, scene, settings).radiance;
      double sum[3] = {0, 0, 0};
      for (int s = 0; s < kSpp; ++s) {
        const auto sample = replay(device, scene, settings, kPixel, s, Precision::Single);
        for (std::size_t c = 0; c < 3; ++c) sum[c] += named(sample, "contribution")[c];
      }
      for (int c = 0; c < 3; ++c)  // a sum of twenty floats, in another order
        EXPECT_NEAR(sum[c], picture.plane(c)[kPixel], 32 * 0x1p-24 * sum[c]) << points << ", lamp " << lamp;
    }
}

// Half of a pixel's directions, say, are aimed: that many samples name their lamp, and lie about its axis.
TEST_F(ReplayTest, SaysWhichLampASampleWasDrawnTowards) {
  settings.sampler = "guided";
  settings.lamps = {{{0.5, 2.5, 0.5}, 0.6, {4, 3, 2}}, {{-1, 2, 1}, 0.3, {9, 9, 9}}};
  int aimed = 0;
  double chance = 0;
  for (int s = 0; s < kSpp; ++s) {
    const auto sample = replay(device, scene, settings, kPixel, s, Precision::Double);
    chance = named(sample, "probability of lamps").at(0);
    const std::vector<double>&lamp = named(sample, "drawn towards lamp"), &wi = named(sample, "wi, camera");
    EXPECT_EQ(lamp.empty(), named(sample, "random numbers")[2] >= chance);
    if (lamp.empty()) continue;
    ++aimed;
    if (named(sample, "pdf")[0] == 0) continue;  // it would have gone below the surface
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) square += (wi[c] - lamp[c]) * (wi[c] - lamp[c]);
    // sharpness d^2 / 2 is distributed as an exponential: above 20 once in 5e8
    EXPECT_LT(lamp[3] * square / 2, 20) << "sample " << s;
  }
  EXPECT_NEAR(aimed, kSpp * chance, 5 * std::sqrt(kSpp * chance * (1 - chance)));
  EXPECT_GT(aimed, 0);
  settings.lamps.clear(), settings.sampler = "vndf_caps";
  EXPECT_TRUE(named(replay(device, scene, settings, kPixel, 0, Precision::Double), "probability of lamps").empty());
}

TEST_F(ReplayTest, DoubleIsTheSameSampleWithMoreDigits) {
  settings.lamps = {{{0.5, 2.5, 0.5}, 0.6, {4, 3, 2}}};
  int hits = 0;
  for (int s = 0; s < kSpp; ++s) {
    const auto twice = replay(device, scene, settings, kPixel, s, Precision::Double),
               single = replay(device, scene, settings, kPixel, s, Precision::Single);
    EXPECT_EQ(named(twice, "random numbers"), named(single, "random numbers")) << "made in float, and widened";
    for (const char* name : {"wi, camera", "wi, local", "weight", "radiance"}) {
      const std::vector<double>&a = named(twice, name), b = named(single, name);
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i)  // some hundred roundings; the corner has no mirrors
        EXPECT_NEAR(a[i], b[i], 1e-4 * std::max(1.0, std::abs(a[i]))) << name << ", sample " << s;
    }
    EXPECT_NE(named(twice, "wi, camera"), named(single, "wi, camera"));
    const double u = named(twice, "u")[0];
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(named(twice, "radiance")[c],
                  (1 - u) * named(twice, "radiance in view")[c] +
                      u * (named(twice, "radiance out of view")[c] + named(twice, "radiance of lamps")[c]),
                  1e-12 * (1 + named(twice, "radiance")[c]))
          << "Eq. 6, sample " << s;
    hits += !named(twice, "hit pixel").empty();
  }
  EXPECT_GT(hits, 2);
  EXPECT_LT(hits, kSpp);
}

TEST_F(ReplayTest, RefusesWhatTheReRenderDoesNotHave) {
  EXPECT_THROW(replay(device, scene, settings, -1, 0, Precision::Single), Error);
  EXPECT_THROW(replay(device, scene, settings, kCornerWidth * kCornerHeight, 0, Precision::Single), Error);
  EXPECT_THROW(replay(device, scene, settings, kPixel, kSpp, Precision::Single), Error);
  settings.light = "constant";  // which traces nothing
  const auto sample = replay(device, scene, settings, kPixel, 3, Precision::Single);
  EXPECT_TRUE(named(sample, "u").empty());
  EXPECT_EQ(named(sample, "contribution").size(), 3u);
}

}  // namespace
}  // namespace clerestory
