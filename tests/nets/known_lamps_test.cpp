// Lamps that a scene is known to have: where its photograph is bright, and what drawing directions towards them gains.
#include "nets/known_lamps.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "nets/render_scene.hpp"
#include "tests/nets/corner.hpp"

namespace clerestory {
namespace {

Device& device() {
  static Device d = Device::open();
  return d;
}

/// The corner with nothing bright but a lamp of four pixels on its left wall.
Scene corner_with_lamp() {
  Scene scene = corner();
  for (int y = 0; y < kCornerHeight; ++y)
    for (int x = 0; x < kCornerWidth; ++x)
      for (int c = 0; c < 3; ++c) scene.photo.at(c, y, x) = x >= 3 && x < 5 && y >= 6 && y < 8 ? 100.f : 0.2f;
  return scene;
}

TEST(KnownLamps, BrightPixelsAreLampsWhereTheirSurfaceIs) {
  const Scene scene = corner_with_lamp();
  const std::vector<SoftLamp> lamps = bright_patches(scene);
  ASSERT_FALSE(lamps.empty());
  const Vec3 middle = scene.camera.unproject(4, 7, 1.5 / -scene.camera.ray(4, 7).x);  // on the wall x = -1.5
  double power = 0, area = 0;
  for (const SoftLamp& lamp : lamps) {
    EXPECT_LT(glm::length(lamp.place - middle), 0.4) << "within the lamp's pixels";
    power += lamp.radiance[0] * 2 * M_PI * lamp.size * lamp.size;
  }
  // What the four pixels show of the wall, between the corners of their square.
  const auto on_wall = [&](double x, double y) {
    const Vec3 ray = scene.camera.ray(x, y);
    return -1.5 / ray.x * ray;
  };
  area = glm::length(glm::cross(on_wall(5, 6) - on_wall(3, 8), on_wall(5, 8) - on_wall(3, 6))) / 2;
  EXPECT_NEAR(power / (100 - 0.2) / area, 1, 0.15) << "pixels are taken for as large as they are at their centres";
}

TEST(KnownLamps, ThereAreNoneInTheDarkAndFittedOnesAreAsTheyAre) {
  Scene scene = corner_with_lamp();
  for (float& v : scene.photo.data) v = std::min(v, 0.5f);
  RenderSettings settings;
  EXPECT_TRUE(bright_patches(scene).empty());
  EXPECT_FALSE(known_lamps(scene, settings));
  settings.lamps = {{{1, 2, -1}, 0.5, {3, 3, 3}}};
  const std::optional<Tensor> known = known_lamps(scene, settings);
  ASSERT_TRUE(known);
  EXPECT_EQ(known->shape, (Shape{1, 5, 1, 1}));
  EXPECT_EQ(known->at(0, 1, 0, 0), 2);
  EXPECT_EQ(known->at(0, 3, 0, 0), 0.5);
  EXPECT_GT(known->at(0, 4, 0, 0), 3 / 0.5) << "over the mean of the picture, which is at most 0.5";
  scene = corner_with_lamp(), settings.lamps.clear(), settings.light = "constant";
  EXPECT_FALSE(known_lamps(scene, settings)) << "a light that does not read the photograph at surfaces";
}

/// The corner, all of one radiance but those pixels of its front wall, four metres away.
Scene corner_with(const std::vector<std::pair<int, int>>& bright, float radiance) {
  Scene scene = corner();
  std::ranges::fill(scene.photo.data, 0.2f);
  for (const auto& [x, y] : bright)
    for (int c = 0; c < 3; ++c) scene.photo.at(c, y, x) = radiance, scene.depth.at(0, y, x) = 4;
  for (const auto& [x, y] : bright)
    for (int c = 0; c < 3; ++c) scene.normal.at(c, y, x) = c == 2 ? 1 : 0;
  return scene;
}

TEST(KnownLamps, ABrightPixelHasMoreThanThreeTimesWhatRaysFindOutOfView) {
  const std::vector<std::pair<int, int>> one{{20, 10}};
  for (const bool above : {false, true}) {
    const Scene scene = corner_with(one, above ? 0.61f : 0.59f);
    const double times = scene.photo.at(0, 10, 20) / ambient_of(scene)[0];
    ASSERT_TRUE(above ? times > 3 && times < 3.1 : times < 3 && times > 2.9) << times;
    EXPECT_EQ(bright_patches(scene).size(), above ? 1u : 0u);
  }
}

// Pixels far apart from each other, more than there may be patches.
TEST(KnownLamps, ThereAreEightPatchesAtMost) {
  std::vector<std::pair<int, int>> bright;
  for (int y = 2; y < 14; y += 3)
    for (int x = 2; x < 38; x += 6) bright.emplace_back(x, y);
  EXPECT_EQ(bright_patches(corner_with(bright, 30)).size(), 8u);
  bright.resize(3);
  EXPECT_EQ(bright_patches(corner_with(bright, 30)).size(), 3u) << "each by itself";
}

// Two pixels side by side, too near each other to be split: spread about their middle by half their distance each.
TEST(KnownLamps, APatchIsAsWideAsItsPixelsAndTheirExtent) {
  const Scene scene = corner_with({{20, 10}, {21, 10}}, 30);
  const std::vector<SoftLamp> lamps = bright_patches(scene);
  ASSERT_EQ(lamps.size(), 1u);
  const double pixel = 4 / scene.camera.fx, variance = pixel * pixel / 4;  // of a distance from the middle
  EXPECT_NEAR(lamps[0].size * lamps[0].size, 1.44 * variance / 2 + 0.5 * pixel * pixel, 1e-5 * pixel * pixel);
}

TEST(KnownLamps, TheTwentyThatBringMostAreKept) {
  const Scene scene = corner();
  RenderSettings settings;
  settings.light = "constant";
  for (int k = 0; k < 30; ++k) {  // the brightest are small: power goes with the square of the size
    const double size = 0.1 * (k + 1), radiance = 40 - k;
    settings.lamps.push_back({{0.1 * k, 0, -2}, size, {radiance, radiance, radiance}});
  }
  const std::optional<Tensor> known = known_lamps(scene, settings);
  ASSERT_TRUE(known);
  ASSERT_EQ(known->shape, (Shape{1, 5, 1, 20}));
  const auto power = [](int k) { return std::pow(0.1 * (k + 1), 2) * (40 - k); };
  std::vector<int> order(30);
  for (int k = 0; k < 30; ++k) order[static_cast<std::size_t>(k)] = k;
  std::ranges::sort(order, [&](int a, int b) { return power(a) > power(b); });
  for (int k = 0; k < 20; ++k) EXPECT_NEAR(known->at(0, 0, 0, k), 0.1 * order[static_cast<std::size_t>(k)], 1e-6) << k;
}

/// Pictures by so many seeds.
std::vector<Image> pictures(const Scene& scene, const std::string& sampler, int seeds) {
  RenderSettings settings;
  settings.spp = 64, settings.sampler = sampler;
  std::vector<Image> all;
  for (int s = 0; s < seeds; ++s) {
    settings.seed = static_cast<std::uint32_t>(100 + s);
    all.push_back(render_scene(device(), scene, settings).radiance);
  }
  return all;
}

/// Over seeds: means of values, and squares of their standard errors.
std::pair<std::vector<double>, std::vector<double>> moments(const std::vector<Image>& runs) {
  const double n = static_cast<double>(runs.size());
  std::vector<double> mean(runs[0].data.size(), 0), square = mean;
  for (const Image& run : runs)
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += static_cast<double>(run.data[i]) / n;
  for (const Image& run : runs)
    for (std::size_t i = 0; i < mean.size(); ++i)
      square[i] += std::pow(static_cast<double>(run.data[i]) - mean[i], 2) / (n * (n - 1));
  return {mean, square};
}

// The lamp is hit by one direction in a thousand; who aims at it has the same mean and far less spread.
TEST(KnownLamps, DirectionsTowardsThemGiveTheSamePictureWithAFractionOfItsVariance) {
  const Scene scene = corner_with_lamp();
  constexpr int seeds = 48;
  const auto [by_surface, of_surface] = moments(pictures(scene, "vndf_caps", seeds));
  const auto [by_lamp, of_lamp] = moments(pictures(scene, "guided", seeds));
  double difference = 0, variance = 0, surface = 0, lamp = 0;
  const std::size_t n = scene.photo.pixels();
  for (std::size_t i = 0; i < by_surface.size(); ++i) {
    difference += by_lamp[i] - by_surface[i], surface += of_surface[i], lamp += of_lamp[i];
    if (i < n) variance += 9 * (of_surface[i] + of_lamp[i]);  // channels are alike: of a grey lamp, times three
  }
  EXPECT_LT(lamp, 0.1 * surface);
  EXPECT_LT(std::abs(difference), 4 * std::sqrt(variance)) << "the sum over pixels";
}

}  // namespace
}  // namespace clerestory
