// Metrics against values worked out by hand, and the best constants against exhaustive search.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "experiments/evaluation/metrics.hpp"
#include "experiments/evaluation/summary.hpp"
#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

Image image_of(int width, int height, int channels, std::vector<float> values) {
  Image image(width, height, channels);
  image.data = std::move(values);
  return image;
}

Image ones(int width, int height) { return Image(width, height, 1, 1.0f); }

// Values enter as floats: half an ulp each, a few roundings on the way.
constexpr double float_tolerance = 8 * 6e-8;

TEST(EvaluationMetrics, MeanAngleOfKnownVectors) {
  const Image truth = image_of(3, 1, 3, {0, 0, 0, 0, 0, 0, 1, 1, 1});
  // the same direction at another length, a right angle, and the opposite one
  const Image predicted = image_of(3, 1, 3, {0, 1, 0, 0, 0, 0, 7, 0, -1});
  EXPECT_NEAR(*mean_angle(predicted, truth, ones(3, 1)), (0 + 90 + 180) / 3.0, 180 * float_tolerance);
  EXPECT_NEAR(*mean_angle(predicted, truth, image_of(3, 1, 1, {1, 1, 0})), 45, 180 * float_tolerance);
  // 0.001 radians: an arc cosine in float would see nothing
  const Image near = image_of(1, 1, 3, {0.001f, 0, 1});
  EXPECT_NEAR(*mean_angle(near, image_of(1, 1, 3, {0, 0, 1}), ones(1, 1)), std::atan(0.001) * 180 / M_PI,
              0.06 * float_tolerance);
}

TEST(EvaluationMetrics, VectorWithoutLengthCountsAsRightAngle) {
  EXPECT_DOUBLE_EQ(*mean_angle(Image(1, 1, 3), image_of(1, 1, 3, {0, 0, 1}), ones(1, 1)), 90);
}

TEST(EvaluationMetrics, SiLogIsTheDeviationOfLogRatios) {
  const Image truth = image_of(2, 2, 1, {1, 2, 4, 100});
  const Image predicted = image_of(2, 2, 1, {1, 1, 1, 1});
  const Image mask = image_of(2, 2, 1, {1, 1, 1, 0});
  // ln ratios 0, -ln2, -2 ln2: population deviation ln2 sqrt(2/3)
  const double expected = std::log(2.0) * std::sqrt(2.0 / 3);
  EXPECT_NEAR(*rooted_si_log(predicted, truth, mask), expected, float_tolerance);
  Image scaled = predicted;
  for (float& v : scaled.data) v *= 0.125f;
  EXPECT_NEAR(*rooted_si_log(scaled, truth, mask), expected, float_tolerance);
}

TEST(EvaluationMetrics, SiLogFloorsPredictionsAndRefusesImpossibleTruth) {
  const Image truth = image_of(2, 1, 1, {1, 1});
  EXPECT_NEAR(*rooted_si_log(image_of(2, 1, 1, {0, 1}), truth, ones(2, 1)), -std::log(least_relative_depth) / 2,
              float_tolerance);
  EXPECT_THROW(rooted_si_log(truth, image_of(2, 1, 1, {0, 1}), ones(2, 1)), Error);
}

TEST(EvaluationMetrics, ScaleInvariantMseFitsOneScale) {
  const Image truth = image_of(2, 1, 3, {1, 0, 1, 0, 0, 0});
  const Image predicted = image_of(2, 1, 3, {2, 0, 0, 0, 0, 2});
  // s = 2/8 = 1/4: residuals of the six values (-1/2, 0, -1, 0, 0, 1/2)
  EXPECT_NEAR(*scale_invariant_mse(predicted, truth, ones(2, 1)), (0.25 + 1 + 0.25) / 6, float_tolerance);
  EXPECT_NEAR(*scale_invariant_mse(Image(2, 1, 3), truth, ones(2, 1)), 2.0 / 6, float_tolerance);
}

TEST(EvaluationMetrics, ChannelMseLooksAtOneChannel) {
  const Image truth = image_of(2, 1, 2, {0.5f, 0.5f, 1, 0}), predicted = image_of(2, 1, 2, {0.25f, 0.5f, 0, 0});
  EXPECT_NEAR(*channel_mse(predicted, truth, ones(2, 1), 0), 0.0625 / 2, float_tolerance);
  EXPECT_NEAR(*channel_mse(predicted, truth, ones(2, 1), 1), 0.5, float_tolerance);
}

TEST(EvaluationMetrics, NothingValidGivesNothingAndUnlikeSizesThrow) {
  const Image one = ones(2, 1), none(2, 1, 1);
  EXPECT_FALSE(rooted_si_log(one, one, none));
  EXPECT_FALSE(mean_angle(Image(2, 1, 3), Image(2, 1, 3), none));
  EXPECT_FALSE(scale_invariant_mse(one, one, none));
  EXPECT_FALSE(channel_mse(one, one, none, 0));
  EXPECT_FALSE(best_constant_normal(Image(2, 1, 3), none));
  EXPECT_THROW(rooted_si_log(one, ones(1, 2), one), Error);
}

TEST(EvaluationMetrics, BestNormalBeatsEveryDirectionOfAFineGrid) {
  std::mt19937 random(4);
  std::normal_distribution<double> gauss;
  const Vec3 walls[] = {{0, 1, 0}, {0.8, 0, 0.6}, {-0.6, 0, 0.8}};
  constexpr int n = 300;
  Image truth(n, 1, 3);
  std::vector<Vec3> normals;
  for (int i = 0; i < n; ++i) {
    const Vec3 v = glm::normalize(walls[i % 5 == 0   ? 0
                                        : i % 3 == 0 ? 1
                                                     : 2] +
                                  0.1 * Vec3(gauss(random), gauss(random), gauss(random)));
    normals.push_back(v);
    for (int c = 0; c < 3; ++c) truth.plane(c)[i] = static_cast<float>(v[c]);
  }
  const Vec3 best = *best_constant_normal(truth, ones(n, 1));
  EXPECT_DOUBLE_EQ(glm::length(best), 1);
  const auto cost = [&](const Vec3& d) {
    double total = 0;
    for (const Vec3& v : normals) total += std::acos(std::clamp(glm::dot(v, d), -1.0, 1.0));
    return total / n;
  };
  double least = 10;
  for (int t = 0; t <= 180; ++t)
    for (int p = 0; p < 360; ++p) {
      const double theta = t * M_PI / 180, phi = p * M_PI / 180;
      least =
          std::min(least, cost({std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)}));
    }
  EXPECT_LE(cost(best), least + 1e-6);  // the descent stops when it gains less than 1e-7
}

TEST(EvaluationMetrics, BestConstantsAreBest) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.1f, 1);
  MapSet truth{Image(8, 4, 3), Image(8, 4, 3), Image(8, 4, 1), Image(8, 4, 2)};
  for (Image* map : {&truth.albedo, &truth.normal, &truth.depth, &truth.material})
    for (float& v : map->data) v = uniform(random);
  const MapMasks masks{ones(8, 4), ones(8, 4), ones(8, 4)};
  const MapErrors best = best_constant_errors(truth, masks);
  for (int trial = 0; trial < 300; ++trial) {
    MapSet constant{Image(8, 4, 3), Image(8, 4, 3), Image(8, 4, 1), Image(8, 4, 2)};
    for (Image* map : {&constant.albedo, &constant.normal, &constant.depth, &constant.material})
      for (int c = 0; c < map->channels; ++c) std::fill_n(map->plane(c), map->pixels(), uniform(random));
    const MapErrors errors = map_errors(constant, truth, masks);
    for (int m = 0; m < map_error_count; ++m)
      EXPECT_GE(*errors[m], *best[m] * (1 - 1e-6)) << info(static_cast<MapError>(m)).key;
  }
  // one value of the five by hand: the variance of roughness
  double mean = 0, variance = 0;
  for (int i = 0; i < 32; ++i) mean += truth.material.data[i] / 32.0;
  for (int i = 0; i < 32; ++i) variance += std::pow(truth.material.data[i] - mean, 2) / 32;
  EXPECT_NEAR(*best[3], variance, float_tolerance);
}

ViewResult result_of(double ours, double constant, double mean) {
  ViewResult r;
  r.ours[0] = ours, r.constant[0] = constant, r.mean_map[0] = mean;
  return r;
}

TEST(EvaluationSummary, RatioIsToTheTrivialPredictorWithTheLeastMean) {
  const EvaluationSummary s = summarise({result_of(1, 4, 1), result_of(3, 2, 7)});
  ASSERT_EQ(s.metrics.size(), 1u);  // metrics that no view has are left out
  const MetricSummary& m = s.metrics[0];
  EXPECT_EQ(m.best, "best constant");
  EXPECT_DOUBLE_EQ(m.ours.mean, 2);
  EXPECT_DOUBLE_EQ(m.ratio, 2.0 / 3);
  EXPECT_DOUBLE_EQ(m.strict_ratio, 2 / 1.5);  // least of each view: 1 and 2
  EXPECT_DOUBLE_EQ(s.score(), 2.0 / 3);
}

// A ratio to nothing says nothing; an error that is no number says that the net gives none.
TEST(EvaluationSummary, ScorePassesOverRatiosToNothingAndNotOverNaN) {
  ViewResult view = result_of(1, 4, 2);
  view.ours[1] = 0.5, view.constant[1] = 0;
  EXPECT_DOUBLE_EQ(summarise({view}).score(), 0.5);
  view.ours[1] = std::nan("");
  EXPECT_TRUE(std::isnan(summarise({view}).score()));
  view.constant[1] = 1;
  EXPECT_TRUE(std::isnan(summarise({view}).score()));
}

TEST(EvaluationSummary, PredictorThatMissesViewsIsNotTheBest) {
  ViewResult without = result_of(3, 2, 0);
  without.mean_map[0].reset();
  const EvaluationSummary s = summarise({result_of(1, 4, 0.1), without});
  EXPECT_EQ(s.metrics[0].best, "best constant");
}

TEST(EvaluationSummary, FrameErrorIsOfThePixelsThatWereMeasured) {
  const Image measured = image_of(4, 1, 1, {0, 1, 2, 0});
  const FrameResult f = judge_frame("f", image_of(4, 1, 1, {9, 1, 4, 9}), std::log(18.0), measured, nullptr);
  EXPECT_NEAR(f.ours, std::log(2.0) / 2, float_tolerance);
  EXPECT_NEAR(f.constant, std::log(2.0) / 2, float_tolerance);
  EXPECT_DOUBLE_EQ(f.valid_share, 0.5);
  EXPECT_NEAR(f.scale, 18 / 1.99, 9 * float_tolerance) << "99th percentiles";
  EXPECT_NEAR(f.metres, 3, 3 * float_tolerance)
      << "depth in metres is 18, 2, 8, 18: twice and four times what was measured";
  EXPECT_THROW(judge_frame("f", ones(4, 1), 0, Image(4, 1, 1), nullptr), Error);
}

}  // namespace
}  // namespace clerestory
