// The layer under the tracer's own light is the tracer's picture; and the statistics that say so can say no.
#include "experiments/studies/truth_study.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "experiments/evaluation/picture_error.hpp"
#include "experiments/studies/agreement.hpp"
#include "experiments/truth/traced_room.hpp"
#include "experiments/truth/truth_light.hpp"
#include "host/math/statistics.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

constexpr int kBatches = 16;
// One false alarm in ten thousand seeds, and the seeds are fixed.
constexpr double kSurprise = 1e-4;

double p_value(const Agreement& a) { return student_two_sided_p(a.z(), kBatches - 1); }

/// A bare room with a lamp, a few blocks and balls, seen in 16 x 12 pixels.
class TruthStudy : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    device_.emplace(Device::open());
    const Room room = make_box_room(11);  // with polished blocks beside the lamp it takes more samples to see anything
    traced_.emplace(*device_, room.scene);
    const Camera camera = choose_views(*traced_, room, 1, 16, 12, Random(5)).at(0);
    scene_ = scene_of(traced_->maps(camera), camera);
  }
  static void TearDownTestSuite() { traced_.reset(), device_.reset(); }
  static TruthComparison compare(const Scene& scene) {
    return compare_with_tracer(*device_, *traced_, scene,
                               {.batches = kBatches, .layer_spp = 256, .picture_spp = 128, .seed = 7});
  }
  static inline std::optional<Device> device_;
  static inline std::optional<TraceScene> traced_;
  static inline Scene scene_;
};

TEST_F(TruthStudy, TheLayerUnderTrueLightIsTheTracersPicture) {
  const TruthComparison c = compare(scene_);
  EXPECT_EQ(c.dropped, 0);
  EXPECT_GT(c.reflected.pixels, 0.8 * 16 * 12);
  EXPECT_GE(c.reflected.share(), least_share(c.reflected, 0.9975));
  EXPECT_GT(p_value(c.reflected), kSurprise) << c.reflected.z();
  EXPECT_GT(p_value(c.whole), kSurprise) << c.whole.z();
  EXPECT_LT(c.reflected.error, 0.01) << "the test sees nothing";
  // Rays that hit the lamp by chance are few at 4096 samples a pixel: skewed values leave their limits more often.
  EXPECT_GT(c.whole.share(), 0.97);
  EXPECT_GT(c.whole_by_stated, 0.95);
}

TEST(TruthLight, PathsOfTheLayersRaysHaveOneScatteringLessThanAPicture) {
  EXPECT_EQ(reflected_light(1, {}).max_depth, kMaxDepth - 1);
  EXPECT_EQ(emitted_light().max_depth, 0);
}

TEST_F(TruthStudy, AnAlbedoThatIsTenPercentOffIsSeen) {
  Scene darker = scene_;
  for (float& a : darker.albedo.data) a *= 0.9f;
  const TruthComparison c = compare(darker);
  EXPECT_LT(p_value(c.reflected), kSurprise) << c.reflected.z();
  EXPECT_LT(c.reflected.difference, 0);
}

/// Batches of pixels around `mean`, their channels independent.
Batches normal_batches(std::size_t pixels, double mean, double deviation, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(mean, deviation);
  Batches batches(kBatches, std::vector<double>(3 * pixels));
  for (auto& batch : batches)
    for (double& v : batch) v = normal(random);
  return batches;
}

TEST(Compare, SharesAndDifferencesOfNormalValues) {
  const std::size_t pixels = 4000;
  std::vector<bool> used(pixels, true);
  used[5] = false;
  const Batches ours = normal_batches(pixels, 2, 0.4, 1), same = normal_batches(pixels, 2, 0.2, 2);
  const Agreement a = agreement(ours, same, used, 0.99);
  EXPECT_EQ(a.values, 3.0 * (pixels - 1));
  // Unlike variances do no harm: the share is binomial, four deviations.
  EXPECT_NEAR(a.share(), 0.99, 4 * std::sqrt(0.99 * 0.01 / a.values));
  EXPECT_GT(p_value(a), kSurprise);
  // The sum's error: sqrt(0.4^2 + 0.2^2) / sqrt(16 x values) / 2, itself known to 18 %.
  EXPECT_NEAR(a.error / (std::sqrt(0.2) / std::sqrt(kBatches * a.values) / 2), 1, 4 * 0.18);
  EXPECT_GE(a.share(), least_share(a, 0.99));

  const Agreement off = agreement(ours, normal_batches(pixels, 2.01, 0.2, 3), used, 0.99);
  EXPECT_NEAR(off.difference, -0.01 / 2.01, 4.5 * off.error);
  EXPECT_LT(p_value(off), kSurprise);
  const Agreement both = together({a, off});
  EXPECT_EQ(both.values, a.values + off.values);
  EXPECT_DOUBLE_EQ(both.difference, 0.5 * (a.difference + off.difference));
  EXPECT_THROW(agreement({ours[0]}, {same[0]}, used, 0.99), Error);
}

TEST(Compare, StatedErrors) {
  const std::vector<bool> used{true, true, true, false};
  // Differences of 0, 1, 3 and one that is not asked; the errors are 1 together, the limit of 95 % is 1.96.
  const std::vector<double> zero(12, 0), off{0, 1, 3, 9, 0, 1, 3, 9, 0, 1, 3, 9}, half(12, 0.5);
  EXPECT_DOUBLE_EQ(share_by_stated(off, half, zero, half, used, 0.95), 2.0 / 3);
  EXPECT_DOUBLE_EQ(share_by_stated(off, zero, zero, zero, used, 0.95), 1.0 / 3) << "no error, no excuse";
}

TEST(Compare, PictureErrors) {
  Image truth(2, 1, 3, 0.5f), picture(2, 1, 3, 0.25f);
  truth.data[1] = 100, picture.data[1] = -7;  // pixel 1 is not compared
  const std::vector<bool> used{true, false};
  const RadianceError e = picture_error(picture, truth, used);
  EXPECT_DOUBLE_EQ(e.relmse, 0.0625 / 0.26);
  EXPECT_DOUBLE_EQ(e.psnr, -10 * std::log10(0.0625));
  // The best multiple is found to half a step of 1.75 %.
  EXPECT_LT(best_scaled_error(picture, truth, used).relmse, std::pow(0.5 * 0.00875, 2) / 0.26 * 1.01);
  EXPECT_GT(best_scaled_error(picture, truth, used).psnr, 40);
}

}  // namespace
}  // namespace clerestory
