// Errors of other groups' scripts beside torchmetrics and scikit-image: tests/data/benchmarks is written by
// experiments/peers/golden_benchmarks.py, figures and all.
#include "experiments/evaluation/benchmark_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/error.hpp"
#include "host/io/json_file.hpp"
#include "host/io/resize.hpp"
#include "host/io/safetensors.hpp"

namespace clerestory {
namespace {

struct BenchmarkErrors : testing::Test {
  const std::string folder = std::string(CLERESTORY_TEST_DATA) + "/benchmarks/";
  const nlohmann::json figures = read_json_object(folder + "figures.json");
  const TensorFile file = read_safetensors(folder + "maps.safetensors");

  Image map(const std::string& name) const {
    const StoredTensor& stored = file.get(name, "maps");
    Image image(static_cast<int>(stored.shape[2]), static_cast<int>(stored.shape[1]),
                static_cast<int>(stored.shape[0]));
    image.data = stored.floats();
    return image;
  }
  Image predicted(const std::string& name) const { return map(name + ".predicted"); }
  /// torchmetrics computes in float what it is given in float; what is computed in double agrees to 1e-6 and better.
  void expect(double ours, const std::string& name, double tolerance = 1e-6) const {
    EXPECT_NEAR(ours, figures.at(name).get<double>(), tolerance) << name;
  }
};

TEST_F(BenchmarkErrors, PicturesAreJudgedAsByTorchmetricsAndScikitImage) {
  expect(psnr(predicted("albedo"), map("albedo")), "psnr", 1e-4);
  expect(ssim(predicted("albedo"), map("albedo"), Border::Mirrored), "ssim_mirrored");
  expect(ssim(predicted("albedo"), map("albedo"), Border::LeftOut), "ssim_left_out");
  EXPECT_GT(std::abs(figures.at("ssim_mirrored").get<double>() - figures.at("ssim_left_out").get<double>()), 0.01);
}

TEST_F(BenchmarkErrors, MasksAndScalesAreThoseOfThePeers) {
  const Image mask = map("mask"), albedo = map("albedo");
  expect(*masked_mse(predicted("albedo"), albedo, mask), "albedo_mse");
  Image scaled = predicted("albedo");
  const double scale = fitted_scale(scaled, albedo, mask);
  for (float& v : scaled.data) v = std::clamp(static_cast<float>(scale * v), 0.0f, 1.0f);
  expect(*masked_mse(scaled, albedo, mask), "albedo_scaled_mse");
  expect(*scaled_log_depth_error(predicted("depth"), map("depth"), mask), "depth_scaled_log");
}

TEST_F(BenchmarkErrors, NormalsAreJudgedAtUnitLengthOrAsTheyAre) {
  const auto unit = normal_angles(predicted("normal"), map("normal"), map("mask"), Lengths::Unit),
             raw = normal_angles(predicted("normal"), map("normal"), map("mask"), Lengths::AsTheyAre);
  ASSERT_TRUE(unit && raw);
  expect(unit->mean, "normal_mean", 1e-5), expect(unit->median, "normal_median", 1e-5);
  expect(raw->mean, "normal_mean_raw", 1e-5), expect(raw->median, "normal_median_raw", 1e-5);
  EXPECT_GT(std::abs(raw->mean - unit->mean), 1);
}

TEST_F(BenchmarkErrors, LogarithmsAreCentredOverAllPixelsAndJudgedWithinLimits) {
  const auto error = centred_log_error(predicted("depth"), map("depth"));
  ASSERT_TRUE(error);
  expect(*error, "depth_log");
  expect(std::sqrt(*error), "depth_log_rooted");
  Image scaled = predicted("depth");
  for (float& v : scaled.data) v *= 4;
  EXPECT_NEAR(*centred_log_error(scaled, map("depth")), *error, 1e-9) << "a scale is free";
}

TEST_F(BenchmarkErrors, PixelsWithoutATrueDepthCountNowhere) {
  Image truth(4, 1, 1), ours(4, 1, 1);
  truth.data = {2, 4, 20, 0}, ours.data = {2, 2, 10, 7};
  // ln ratios 0, -ln 2, -ln 2 about their mean -2/3 ln 2; 20 m are beyond the limit
  EXPECT_NEAR(*centred_log_error(ours, truth), std::pow(std::log(2.0), 2) * (4.0 / 9 + 1.0 / 9) / 2, 1e-7);
  EXPECT_FALSE(centred_log_error(ours, Image(4, 1, 1, 20.0f)));
  EXPECT_FALSE(centred_log_error(ours, Image(4, 1, 1)));
}

TEST_F(BenchmarkErrors, MapsAreResizedAsByPyTorch) {
  const Image theirs = map("albedo.resized"), ours = resize_bilinear(map("albedo"), theirs.width, theirs.height);
  EXPECT_GT(theirs.width, map("albedo").width) << "grown";
  EXPECT_LT(theirs.height, map("albedo").height) << "and shrunk";
  for (std::size_t i = 0; i < theirs.data.size(); ++i) ASSERT_NEAR(ours.data[i], theirs.data[i], 1e-6) << i;
}

TEST_F(BenchmarkErrors, EqualPicturesAreInfinitelyAlikeAndSmallOnesAreRefused) {
  const Image albedo = map("albedo");
  EXPECT_TRUE(std::isinf(psnr(albedo, albedo)));
  EXPECT_NEAR(ssim(albedo, albedo, Border::Mirrored), 1, 1e-12);
  EXPECT_THROW(ssim(Image(10, 20, 3), Image(10, 20, 3), Border::LeftOut), Error);
  EXPECT_THROW(psnr(albedo, Image(albedo.width, albedo.height, 1)), Error);
  EXPECT_FALSE(normal_angles(Image(2, 1, 3), Image(2, 1, 3), Image(2, 1, 1), Lengths::Unit));
  EXPECT_FALSE(masked_mse(Image(2, 1, 3), Image(2, 1, 3), Image(2, 1, 1)));
}

TEST_F(BenchmarkErrors, ANormalWithoutLengthIsARightAngle) {
  Image truth(1, 1, 3), mask(1, 1, 1, 1.0f);
  truth.data = {0, 0, 2};
  for (const Lengths lengths : {Lengths::Unit, Lengths::AsTheyAre})
    EXPECT_DOUBLE_EQ(normal_angles(Image(1, 1, 3), truth, mask, lengths)->mean, 90);
  Image half(1, 1, 3);
  half.data = {0, 0, 0.5f};
  EXPECT_NEAR(normal_angles(half, truth, mask, Lengths::AsTheyAre)->mean, 60, 1e-9) << "the truth has unit length";
  EXPECT_EQ(normal_angles(half, truth, mask, Lengths::Unit)->mean, 0);
}

}  // namespace
}  // namespace clerestory
