// Lamps fitted to a photograph: found again where one stood, none where none is missing.
#include "nets/soft_lamps.hpp"

#include <gtest/gtest.h>

#include "nets/render_scene.hpp"
#include "nets/scene_radiance.hpp"
#include "tests/nets/corner.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

Device& device() {
  static Device d = Device::open();
  return d;
}

RenderSettings under_constant(int spp) {
  RenderSettings settings;
  settings.light = "constant", settings.spp = spp, settings.seed = 5;
  return settings;
}

const SoftLamp kLamp{{0.9, 2.2, -1.0}, 0.5, {6, 5, 3}};  // above the picture, at the right

/// The corner lit by its own mean from all around, and by the lamp: light = constant reads the mean of the picture that
/// it makes, so the picture is a fixed point.
Scene lit_corner() {
  Scene scene = corner();
  std::fill(scene.photo.data.begin(), scene.photo.data.end(), 0.f);
  RenderSettings settings = under_constant(256);
  settings.lamps = {kLamp};
  for (int i = 0; i < 12; ++i) scene.photo = render_scene(device(), scene, settings).radiance;
  return scene;
}

double relative_error(const Image& picture, const Image& truth) {
  double sum = 0, mean = 0;
  for (const float v : truth.data) mean += static_cast<double>(v) / static_cast<double>(truth.data.size());
  for (std::size_t i = 0; i < truth.data.size(); ++i) {
    const double d = static_cast<double>(picture.data[i] - truth.data[i]) / (static_cast<double>(truth.data[i]) + mean);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(truth.data.size()));
}

TEST(SoftLamps, ExplainTheShadingOfOne) {
  const Scene scene = lit_corner();
  RenderSettings settings = under_constant(64);
  const LampFit fit = fit_lamps(device(), scene, settings);
  ASSERT_FALSE(fit.lamps.empty());
  EXPECT_LT(fit.lamps.size(), fit.candidates);
  EXPECT_LT(fit.after, 0.3 * fit.before) << "lamps between the candidates are sums of them";
  double toward = 0, all = 0;
  for (const SoftLamp& lamp : fit.lamps) {
    const auto at = scene.camera.project(lamp.place);
    EXPECT_FALSE(at && at->x >= 0 && at->y >= 0 && at->x < kCornerWidth && at->y < kCornerHeight) << "in the picture";
    const double light = (lamp.radiance[0] + lamp.radiance[1] + lamp.radiance[2]) * lamp.size * lamp.size /
                         glm::dot(lamp.place, lamp.place);
    for (const double r : lamp.radiance) EXPECT_GE(r, 0);
    all += light;
    if (glm::dot(glm::normalize(lamp.place), glm::normalize(kLamp.place)) > 0.7) toward += light;
  }
  EXPECT_GT(toward, 0.5 * all) << "most light comes from where the lamp is";

  const double without = relative_error(render_scene(device(), scene, settings).radiance, scene.photo);
  settings.lamps = fit.lamps;
  const double with = relative_error(render_scene(device(), scene, settings).radiance, scene.photo);
  EXPECT_LT(with, 0.4 * without) << "at all pixels, not only those of the grid, and with other samples";
}

TEST(SoftLamps, SameBitsRunToRunAndLinearInThePhotographsUnit) {
  Scene scene = lit_corner();
  const LampFit a = fit_lamps(device(), scene, under_constant(16)), b = fit_lamps(device(), scene, under_constant(16));
  for (float& v : scene.photo.data) v *= 8;  // exact
  const LampFit brighter = fit_lamps(device(), scene, under_constant(16));
  ASSERT_EQ(a.lamps.size(), b.lamps.size());
  ASSERT_EQ(a.lamps.size(), brighter.lamps.size());
  for (std::size_t k = 0; k < a.lamps.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(a.lamps[k].radiance[c], b.lamps[k].radiance[c]);
      EXPECT_EQ(brighter.lamps[k].radiance[c], 8 * a.lamps[k].radiance[c]);
    }
}

TEST(SoftLamps, WhatEmitsIsNotExplained) {
  Scene dim = lit_corner();
  for (std::size_t i = 0; i < dim.photo.pixels() / 4; ++i) dim.material.plane(2)[i] = 1;
  Scene bright = dim;
  for (int c = 0; c < 3; ++c) std::fill_n(bright.photo.plane(c), dim.photo.pixels() / 4, 1000.f);
  const LampFit a = fit_lamps(device(), dim, under_constant(16)), b = fit_lamps(device(), bright, under_constant(16));
  ASSERT_FALSE(a.lamps.empty());
  ASSERT_EQ(a.lamps.size(), b.lamps.size());
  for (std::size_t k = 0; k < a.lamps.size(); ++k) EXPECT_EQ(a.lamps[k].radiance, b.lamps[k].radiance);
}

// What the layer drops.
TEST(SoftLamps, OnePixelThatIsNoNumberTakesNoLampAway) {
  Scene scene = lit_corner();
  const LampFit whole = fit_lamps(device(), scene, under_constant(16));
  for (std::size_t i = 0; i < scene.photo.pixels(); i += 7) scene.material.plane(1)[i] = std::nanf("");
  const LampFit without = fit_lamps(device(), scene, under_constant(16));
  ASSERT_FALSE(without.lamps.empty());
  EXPECT_LT(without.after, 0.5 * without.before);
  EXPECT_NEAR(without.after, whole.after, 0.5 * whole.after);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(without.missing[c], whole.missing[c], 0.05 * whole.missing[c]);
}

TEST(SoftLamps, AreFittedWithTheSamplerAndTheSurfacesThatRender) {
  const Scene scene = lit_corner();
  const LampFit usual = fit_lamps(device(), scene, under_constant(64));
  const auto fit_under = [&](auto change) {
    RenderSettings settings = under_constant(64);
    change(settings);
    return fit_lamps(device(), scene, settings);
  };
  // What the light alone leaves is an estimate: another sampler's is another one of the same, about as large.
  for (const LampFit& fit : {fit_under([](RenderSettings& s) { s.sampler = "cosine"; }),
                             fit_under([](RenderSettings& s) { s.sampler = "grid8x16"; }),
                             fit_under([](RenderSettings& s) { s.points = "independent"; })}) {
    EXPECT_NE(fit.before, usual.before);
    EXPECT_NEAR(fit.before, usual.before, 0.2 * usual.before);
    EXPECT_LT(fit.after, 0.6 * fit.before);
  }
  // The surface model of Li et al. knows no metal.
  EXPECT_NE(fit_under([](RenderSettings& s) { s.brdf = "li2020"; }).before, usual.before);
}

// The ridge trades what is left for smaller lamps, the floor says how much errors of dark pixels count: of a dark wall
// that one lamp lights too much, the more the less the floor is.
TEST(SoftLamps, WeightsOfTheFitAreTheSettings) {
  const Scene scene = lit_corner();
  const auto fit_with = [&](double floor, double ridge) {
    RenderSettings settings = under_constant(64);
    settings.fit = {floor, ridge};
    return fit_lamps(device(), scene, settings);
  };
  const auto light = [](const LampFit& fit) {
    double squares = 0;
    for (const SoftLamp& lamp : fit.lamps)
      for (const double r : lamp.radiance) squares += r * r;
    return squares;
  };
  const LampFit loose = fit_with(0.5, 0.01), tight = fit_with(0.5, 10);
  EXPECT_LT(loose.after, tight.after);
  EXPECT_GT(light(loose), light(tight));
  EXPECT_EQ(loose.before, tight.before);
  EXPECT_GT(fit_with(0.1, 1).before, loose.before) << "relative to less";
}

TEST(SoftLamps, NoneWhereNothingIsMissing) {
  Scene scene = corner();
  std::fill(scene.photo.data.begin(), scene.photo.data.end(), 0.f);
  const LampFit black = fit_lamps(device(), scene, under_constant(16));
  EXPECT_TRUE(black.lamps.empty());
  EXPECT_EQ(black.before, 0);
  // Lamps in the picture alone raise its mean: white walls under it would be far brighter than the picture shows them.
  scene = corner();
  std::fill(scene.albedo.data.begin(), scene.albedo.data.end(), 1.f);
  for (std::size_t i = 0; i < scene.photo.data.size(); ++i) scene.photo.data[i] = i % 97 == 0 ? 100.f : 1e-3f;
  RenderSettings relative = under_constant(16);
  relative.fit.floor = 0.5;  // of the mean
  const LampFit bright = fit_lamps(device(), scene, relative);
  EXPECT_GT(bright.before, 1);
  EXPECT_EQ(bright.after, bright.before);
  EXPECT_TRUE(bright.lamps.empty());
}

TEST(SoftLamps, ShineWhereARayLeavesWhatIsSeen) {
  const Scene scene = lit_corner();
  RenderSettings settings;
  settings.light = "image";
  Rays rays;
  for (int i = 0; i < 64; ++i) {
    const double a = 0.7 * i, y = 1 - i / 32.0, r = std::sqrt(std::max(0.0, 1 - y * y));
    rays.points.push_back({0.1, 0, -1.5}), rays.directions.push_back(Vec3(r * std::cos(a), y, r * std::sin(a)));
  }
  const RadianceAnswers without = SceneRadiance(device(), scene, settings, 64).radiance(rays);
  settings.lamps = {kLamp};
  const RadianceAnswers with = SceneRadiance(device(), scene, settings, 64).radiance(rays);
  int lit = 0;
  for (std::size_t i = 0; i < 64; ++i) {
    const Vec3 to = kLamp.place - rays.points[i];
    const double r = glm::length(to), cosine = glm::dot(to / r, glm::normalize(rays.directions[i]));
    const double shape = std::exp(-r * r / (kLamp.size * kLamp.size) * (1 - cosine));
    for (std::size_t c = 0; c < 3; ++c) {
      const double expected = without.radiance[c * 64 + i] + without.uncertainty[i] * kLamp.radiance[c] * shape;
      // A few roundings of each factor; 1 - cosine is rounded as 1 is, and counts as often as the exponent has it.
      const double condition = 8 + r * r / (kLamp.size * kLamp.size);
      EXPECT_NEAR(with.radiance[c * 64 + i], expected, 4 * condition * kFloatRounding * expected) << i;
    }
    lit += shape > 0.1 && without.uncertainty[i] > 0.5;
  }
  EXPECT_GT(lit, 0);
}

}  // namespace
}  // namespace clerestory
