// What mirror objects are judged by, on cases done by hand, and where they are made to rest.
#include "experiments/studies/objects_room.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "experiments/studies/resting.hpp"
#include "host/math/radiance.hpp"

namespace clerestory {
namespace {

Image grey(int w, int h, const std::vector<float>& values) {
  Image image(w, h, 3);
  for (int c = 0; c < 3; ++c) std::ranges::copy(values, image.plane(c));
  return image;
}
double energy(const Image& a, const Image& b) { return gradient_energy(a, b, std::vector<bool>(a.pixels(), true)); }

TEST(GradientEnergy, ByHand) {
  // Two rows of three: three steps of ln 2 along a row in all, none between rows but one of ln 4.
  const auto level = [](double factor) { return static_cast<float>(0.5 * factor - kLightFloor); };
  const Image a = grey(3, 2, {level(1), level(2), level(4), level(1), level(2), level(1)});
  const double step = std::log(2), sum = step * step * (1 + 1 + 1 + 1 + 4);
  EXPECT_NEAR(energy(a, a), sum / 7, 1e-6) << "seven pairs of neighbours; values are float";
  // The last column left out: two steps along rows, none across.
  EXPECT_NEAR(gradient_energy(a, a, {true, true, false, true, true, false}), 2 * step * step / 4, 1e-6);
  EXPECT_THROW(gradient_energy(a, a, {false, false, true, true, false, false}), Error)
      << "the end of a row and the next one's begin are no neighbours";
}

TEST(GradientEnergy, NoiseAddsNothingAndBlurTakesAway) {
  constexpr int n = 64;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<float> smooth(n * n), first(n * n), second(n * n);
  double noise = 0;
  for (int i = 0; i < n * n; ++i) {
    const double wave = std::sin(0.7 * (i % n)), a = 0.2 * normal(random), b = 0.2 * normal(random);
    smooth[static_cast<std::size_t>(i)] = static_cast<float>(std::exp(wave));
    first[static_cast<std::size_t>(i)] = static_cast<float>(std::exp(wave + a));
    second[static_cast<std::size_t>(i)] = static_cast<float>(std::exp(wave + b));
    noise += a * a / (n * n);
  }
  const double clean = energy(grey(n, n, smooth), grey(n, n, smooth)),
               apart = energy(grey(n, n, first), grey(n, n, second)),
               same = energy(grey(n, n, first), grey(n, n, first));
  // A product of two independent differences of deviation 0.28 scatters by 0.08 about 0, over 8,000 pairs by 1e-3; with
  // the wave's own differences, of some 0.5, it scatters by 2 * 0.14 / sqrt(8000).
  EXPECT_NEAR(apart, clean, 5 * (0.08 + 0.28) / std::sqrt(2.0 * n * n));
  EXPECT_NEAR(same - clean, 2 * noise, 0.1 * 2 * noise) << "of one picture alone noise counts";
  std::vector<float> blurred = smooth;
  for (int i = 1; i + 1 < n * n; ++i) {
    const auto s = static_cast<std::size_t>(i);
    blurred[s] = (smooth[s - 1] + smooth[s] + smooth[s + 1]) / 3;
  }
  EXPECT_LT(energy(grey(n, n, blurred), grey(n, n, blurred)), 0.8 * clean);
}

TEST(GradientEnergy, NeedsNeighbours) {
  const Image a = grey(2, 2, {1, 1, 1, 1});
  EXPECT_THROW(gradient_energy(a, a, {true, false, false, true}), Error);
}

/// A wall `depth` metres before a camera that looks along its axis.
Scene wall(float depth) {
  Scene scene;
  scene.camera = Camera::from_fov(32, 24, 60);
  scene.photo = Image(32, 24, 3), scene.depth = Image(32, 24, 1, depth);
  return scene;
}

TEST(RestingOn, AsFarAndAsLargeAsTheDepthSays) {
  InsertedObject ball;
  ball.at_point = {0.2, 0.1, -2}, ball.radius = 0.25;
  const InsertedObject moved = resting_on(wall(4), wall(2), ball);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR((*moved.at_point)[i], 2 * (*ball.at_point)[i], 1e-12);
  EXPECT_NEAR(*moved.radius, 0.5, 1e-12);
  InsertedObject mesh;
  mesh.at_point = {0, 0, -2}, mesh.mesh = "bunny.glb", mesh.size = 0.4;
  const InsertedObject nearer = resting_on(wall(1), wall(2), mesh);
  EXPECT_NEAR((*nearer.at_point)[2], -1, 1e-12);
  EXPECT_NEAR(*nearer.size, 0.2, 1e-12);
  EXPECT_FALSE(nearer.radius);
}

TEST(RestingOn, StaysWhereNothingIsKnown) {
  InsertedObject ball;
  ball.at_point = {0, 0, -2}, ball.radius = 0.25;
  EXPECT_EQ(*resting_on(wall(0), wall(2), ball).radius, 0.25) << "no depth is predicted";
  EXPECT_EQ(*resting_on(wall(4), wall(0), ball).radius, 0.25) << "none is known";
  ball.at_point = {10, 0, -2};
  EXPECT_EQ(*resting_on(wall(4), wall(2), ball).radius, 0.25) << "beside the picture";
  ball.at_point = {0, -4, -2};
  EXPECT_EQ(*resting_on(wall(4), wall(2), ball).radius, 0.25) << "its foot is below the picture";
}

}  // namespace
}  // namespace clerestory
