// Rooms painted anew while maps learn: what changes, and what must not.
#include "experiments/training/new_paint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "experiments/training/batches.hpp"
#include "host/math/statistics.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = 70, kHeight = 30;

/// What the columns of the wall are, ten each.
enum Stripe { Rough, Satin, Glossy, Metal, Lamp, NoMaterial, Unknown };
Stripe stripe_of(int x) { return static_cast<Stripe>(x / 10); }
constexpr int kStripes = 7;

/// A wall that runs away from the camera, in stripes of unlike material.
PreparedView wall() {
  PreparedView view;
  view.image = Image(kWidth, kHeight, 3), view.truth.albedo = Image(kWidth, kHeight, 3);
  view.truth.normal = Image(kWidth, kHeight, 3), view.truth.depth = Image(kWidth, kHeight, 1);
  view.truth.material = Image(kWidth, kHeight, 2);
  view.masks = {Image(kWidth, kHeight, 1, 1), Image(kWidth, kHeight, 1, 1), Image(kWidth, kHeight, 1, 1)};
  view.scene_scale = 4, view.camera = Camera::from_fov(kWidth, kHeight, 60);
  look_at(*view.camera, {0, 1.5, 0}, {2, 1, 3});
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Stripe stripe = stripe_of(x);
      for (int c = 0; c < 3; ++c) {
        view.truth.albedo.at(c, y, x) = 0.1f + 0.02f * static_cast<float>(y) + 0.05f * static_cast<float>(c);
        view.image.at(c, y, x) = view.truth.albedo.at(c, y, x) * (stripe == Lamp ? 20.f : 0.5f + 0.01f * float(x));
      }
      view.truth.normal.at(2, y, x) = 1;
      view.truth.depth.at(0, y, x) = 0.3f + 0.01f * static_cast<float>(x);
      view.truth.material.at(0, y, x) = stripe == Rough ? 0.8f : stripe == Satin ? 0.375f : 0.1f;
      view.truth.material.at(1, y, x) = stripe == Metal ? 1.f : 0.f;
      if (stripe == Lamp) view.masks.albedo.at(0, y, x) = 0;
      if (stripe == NoMaterial) view.truth.material.at(0, y, x) = view.masks.material.at(0, y, x) = 0;
      if (stripe == Unknown)
        view.masks.geometry.at(0, y, x) = view.masks.albedo.at(0, y, x) = view.masks.material.at(0, y, x) = 0;
    }
  return view;
}

double factor_at(const Image& after, const Image& before, int c, int y, int x) {
  return static_cast<double>(after.at(c, y, x)) / static_cast<double>(before.at(c, y, x));
}

TEST(NewPaint, ThePictureChangesAsTheAlbedoDoesBesideTheVeil) {
  const PreparedView before = wall();
  int changed[kStripes] = {};
  double most_satin = 0, most_rough = 0;
  for (std::uint64_t key = 0; key < 40; ++key) {
    PreparedView after = before;
    paint_anew(after, key);
    const double exposure = factor_at(after.image, before.image, 0, 0, kWidth - 1);  // where nothing is known
    EXPECT_NEAR(luminance_quantile(after.image.data, 0.95), 0.9, 0.9 * 8 * kFloatRounding);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          const Stripe stripe = stripe_of(x);
          const double was = static_cast<double>(before.truth.albedo.at(c, y, x)),
                       is = static_cast<double>(after.truth.albedo.at(c, y, x)), veil = stripe == Metal ? 0 : 0.05;
          const double expected = exposure * (is + veil) / (was + veil);
          ASSERT_NEAR(factor_at(after.image, before.image, c, y, x), expected, 16 * kFloatRounding * expected);
          ASSERT_GE(is, 0.02 * (1 - kFloatRounding));
          ASSERT_LE(is, std::max(was, stripe == Metal ? 0.92 : 0.78) * (1 + kFloatRounding));
          changed[stripe] += is != was;
          if (stripe == Satin) most_satin = std::max(most_satin, is / was);
          if (stripe == Rough) most_rough = std::max(most_rough, is / was);
        }
    EXPECT_EQ(after.truth.normal.data, before.truth.normal.data);
    EXPECT_EQ(after.truth.depth.data, before.truth.depth.data);
    EXPECT_EQ(after.truth.material.data, before.truth.material.data);
  }
  const int pixels = 40 * 10 * kHeight * 3;
  for (const Stripe painted : {Rough, Satin, Metal}) EXPECT_GT(changed[painted], pixels / 3) << painted;
  for (const Stripe kept : {Glossy, Lamp, NoMaterial, Unknown}) EXPECT_EQ(changed[kept], 0) << kept;
  // Half way from glossy to rough a surface takes half of the paint: what is 0.1 becomes 0.44 at most, and nearly.
  EXPECT_GT(most_rough, 3);
  EXPECT_LE(most_satin, 1 + 0.5 * (0.78 / 0.1 - 1) + 1e-5);
  EXPECT_GT(most_satin, 3.5);
}

TEST(NewPaint, IsAFunctionOfItsKeyAndNeedsACamera) {
  PreparedView one = wall(), again = wall(), other = wall(), blind = wall();
  blind.camera.reset();
  paint_anew(one, 1), paint_anew(again, 1), paint_anew(other, 2), paint_anew(blind, 1);
  EXPECT_EQ(one.image.data, again.image.data);
  EXPECT_EQ(one.truth.albedo.data, again.truth.albedo.data);
  EXPECT_NE(one.truth.albedo.data, other.truth.albedo.data);
  EXPECT_EQ(blind.image.data, wall().image.data);
}

/// The wall, wherever one looks.
struct OneView : TrainingViews {
  bool photograph = false;
  MakeView at(std::uint64_t) override {
    return [this] { return NamedView{"wall", wall(), photograph}; };
  }
  std::vector<ViewName> some(std::uint64_t, std::size_t) override { return {}; }
};

TEST(NewPaint, IsOnTheShareOfViewsThatIsAskedFor) {
  OneView views;
  Augmentation augmentation{.flip = false, .exposure_low = 0.9, .exposure_high = 0.9};
  const auto albedo_of = [&](double share, std::int64_t step) {
    augmentation.painted = share;
    return begin_batch(views, augmentation, 5, 0, step, 1).get().albedo;
  };
  const std::vector<float> plain = albedo_of(0, 0);
  std::set<std::vector<float>> looks;
  int painted = 0;
  for (std::int64_t step = 0; step < 60; ++step) {
    looks.insert(albedo_of(1, step));
    painted += albedo_of(0.5, step) != plain;
  }
  EXPECT_GT(looks.size(), 55u) << "another look each time";
  EXPECT_NEAR(painted, 30, 4 * std::sqrt(60 * 0.5 * 0.5));
  views.photograph = true;
  EXPECT_EQ(albedo_of(1, 0), plain);
}

TEST(NewPaint, OfNothingKnownIsNothing) {
  PreparedView view = wall();
  view.masks = {Image(kWidth, kHeight, 1), Image(kWidth, kHeight, 1), Image(kWidth, kHeight, 1)};
  const Image before = view.image;
  paint_anew(view, 3);
  EXPECT_EQ(view.image.data, before.data);
}

// Where a pixel is wider than any cell what is left of a pattern is its mean: one colour for each of at most 14 parts.
TEST(NewPaint, PatternsFadeIntoTheirMean) {
  PreparedView far = wall();
  far.scene_scale = 4000;
  std::ranges::fill(far.truth.albedo.data, 0.3f);
  for (std::size_t i = 0; i < far.truth.material.pixels(); ++i) far.truth.material.data[i] = 1;
  for (std::uint64_t key = 0; key < 20; ++key) {
    PreparedView after = far;
    paint_anew(after, key);
    const float* red = after.truth.albedo.plane(0);
    const std::set<float> colours(red, red + after.truth.albedo.pixels());
    EXPECT_LE(colours.size(), 15u) << key;
  }
}

// Patterns are paint on surfaces: there are more colours after it than before, and along a row they come back.
TEST(NewPaint, HasPatterns) {
  const PreparedView before = wall();
  int patterned = 0;
  for (std::uint64_t key = 0; key < 40; ++key) {
    PreparedView after = before;
    paint_anew(after, key);
    int steps = 0;  // up and down along the rough and the metal stripes
    for (const int from : {1, 31})
      for (int x = from; x + 1 < from + 8; ++x) {
        const double here = factor_at(after.truth.albedo, before.truth.albedo, 1, 9, x),
                     next = factor_at(after.truth.albedo, before.truth.albedo, 1, 9, x + 1);
        steps += std::abs(here - next) > 0.05;
      }
    patterned += steps > 1;
  }
  EXPECT_GE(patterned, 8);
}

}  // namespace
}  // namespace clerestory
