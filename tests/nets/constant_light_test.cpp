// The constant light fitted to a photograph: found again where it was the light, the least squares solution elsewhere.
#include "nets/constant_light.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "nets/render_scene.hpp"
#include "tests/nets/corner.hpp"

namespace clerestory {
namespace {

Device& device() {
  static Device d = Device::open();
  return d;
}

RenderSettings settings(int spp) {
  RenderSettings s;
  s.light = "image", s.spp = spp, s.seed = 5;  // whatever the light: a constant is fitted
  return s;
}

TEST(ConstantLight, IsFoundAgain) {
  Scene scene = corner();
  RenderSettings truth = settings(64);
  truth.light = "constant", truth.constant = {{2.0, 0.7, 0.1}};
  scene.photo = render_scene(device(), scene, truth).radiance;
  const std::array<double, 3> fitted = fit_constant(device(), scene, settings(64));
  // The same samples light both, so that only float rounds: of products and of sums of 64 of them.
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(fitted[c] / (*truth.constant)[c], 1, 64 * 0x1p-23);
}

TEST(LightLevel, MultipliesTheChannels) {
  for (const char* light : {"image", "panorama", "mirrored"}) {
    Scene scene = corner();
    RenderSettings truth = settings(64);
    truth.light = light, truth.level = {{3.0, 0.5, 1.25}};
    const Image lit = render_scene(device(), scene, truth).radiance;
    truth.level.reset();
    const Image plain = render_scene(device(), scene, truth).radiance;
    for (std::size_t i = 0; i < plain.data.size(); ++i) {
      const double factor = std::array{3.0, 0.5, 1.25}[i / plain.pixels()];
      EXPECT_NEAR(lit.data[i], factor * static_cast<double>(plain.data[i]),
                  64 * 0x1p-23 * factor * static_cast<double>(plain.data[i]))
          << light;
    }
  }
}

TEST(LightLevel, NoOtherLevelIsCloserByTheLampsMeasure) {
  Scene scene = corner();
  RenderSettings s = settings(16);
  s.light = "mirrored", s.fit.floor = 0.2;
  const std::array<double, 3> fitted = fit_level(device(), scene, s);
  const Image plain = render_scene(device(), scene, s).radiance;
  const std::size_t n = plain.pixels();
  for (std::size_t c = 0; c < 3; ++c) {
    double mean = 0, count = 0;
    for (std::size_t i = 0; i < n; ++i)
      if (plain.data[c * n + i] > 0) mean += static_cast<double>(scene.photo.data[c * n + i]), ++count;
    const auto squares = [&](double factor) {
      double all = 0;
      for (std::size_t i = 0; i < n; ++i) {
        const auto seen = static_cast<double>(scene.photo.data[c * n + i]),
                   is = factor * fitted[c] * static_cast<double>(plain.data[c * n + i]);
        if (is > 0) all += std::pow((is - seen) / (seen + s.fit.floor * mean / count), 2);
      }
      return all;
    };
    EXPECT_GT(fitted[c], 0);
    EXPECT_LT(squares(1), squares(0.99));
    EXPECT_LT(squares(1), squares(1.01));
  }
}

TEST(ConstantLight, NoOtherConstantIsCloserByTheLampsMeasure) {
  constexpr double floor = 0.2;
  Scene scene = corner();
  RenderSettings lit = settings(16);
  lit.light = "constant", lit.constant = {{1.0, 1.0, 1.0}};
  lit.lamps = {{{0.9, 2.2, -1.0}, 0.5, {6, 5, 3}}};
  scene.photo = render_scene(device(), scene, lit).radiance;
  RenderSettings weighted = settings(16);
  weighted.fit.floor = floor;
  const std::array<double, 3> fitted = fit_constant(device(), scene, weighted);
  const std::size_t n = scene.photo.pixels();
  const auto squares = [&](double factor) {
    RenderSettings s = settings(16);
    s.light = "constant", s.constant = {{factor * fitted[0], factor * fitted[1], factor * fitted[2]}};
    const Image picture = render_scene(device(), scene, s).radiance;
    double all = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      double mean = 0, count = 0;
      for (std::size_t i = 0; i < n; ++i)
        if (picture.plane(static_cast<int>(c))[i] > 0) mean += scene.photo.plane(static_cast<int>(c))[i], ++count;
      for (std::size_t i = 0; i < n; ++i) {
        const double seen = scene.photo.plane(static_cast<int>(c))[i], is = picture.plane(static_cast<int>(c))[i];
        if (is > 0) all += std::pow((is - seen) / (seen + floor * mean / count), 2);
      }
    }
    return all;
  };
  EXPECT_GT(fitted[0], 1.0) << "the lamp's light is in it";
  EXPECT_LT(squares(1), squares(0.99));
  EXPECT_LT(squares(1), squares(1.01));
}

TEST(ConstantLight, OfABlackPhotographIsBlack) {
  Scene scene = corner();
  std::fill(scene.photo.data.begin(), scene.photo.data.end(), 0.f);
  for (const double r : fit_constant(device(), scene, settings(4))) EXPECT_EQ(r, 0);
}

}  // namespace
}  // namespace clerestory
