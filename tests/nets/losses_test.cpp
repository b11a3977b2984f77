// VGG16's features and the perceptual distance against PyTorch, and how the terms add up.
#include "nets/losses.hpp"

#include <gtest/gtest.h>

#include "nets/mgnet_training.hpp"
#include "nets/vgg.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

TEST(Losses, PerceptualDistanceIsPytorchs) {
  constexpr Shape kMap{2, 3, 20, 24}, kMask{2, 1, 20, 24};
  GoldenNet net("vgg16.safetensors", Precision::Double);
  const Value image = net.graph.input("image", kMap), truth = net.graph.input("truth", kMap),
              mask = net.graph.input("mask", kMask);
  const Scope scope{net.graph, false, "vgg"};
  const Value distance = perceptual_distance(scope, image, truth, mask);
  const std::map<std::string, Value> results{{"features", vgg_features(scope, image)},
                                             {"perceptual", distance},
                                             {"gradient.image", gradient(distance, std::vector<Value>{image}).front()}};
  net.fill_states();
  Tensor weights = formula("mask", kMask);
  for (double& m : weights.real) m = m > -0.2;
  net.run(results, {{"image", formula("image", kMap)}, {"truth", formula("truth", kMap)}, {"mask", weights}}, false);
  // Golden values are stored in float; double's own rounding is far below.
  for (const auto& [name, value] : results) net.expect_elements(name, name, 0x1p-22);
  EXPECT_TRUE(net.graph.parameters().empty()) << "VGG16 is frozen";
}

/// Loss terms of the compact net on a formula's batch, with these weights, by name.
std::map<std::string, double> terms(const LossWeights& weights) {
  GoldenNet net("vgg16.safetensors", Precision::Single);
  const MgnetTraining training =
      mgnet_training(net.graph, mgnet_size("compact"), {.batch = 1, .height = 32, .width = 32, .weights = weights});
  std::map<std::string, Tensor> feeds;
  const auto put = [&](const std::string& name, const Shape& s, double offset) {
    feeds[name] = formula(name, s);
    for (double& x : feeds[name].real) x += offset;
  };
  put("image", {1, 3, 32, 32}, 0.5), put("albedo", {1, 3, 32, 32}, 0.5), put("normal", {1, 3, 32, 32}, 0);
  put("material", {1, 2, 32, 32}, 0.5), put("depth", {1, 1, 32, 32}, 0.5), put("log_scale", {1, 1, 1, 1}, 1);
  for (const char* mask : {"albedo_mask", "geometry_mask", "material_mask"}) feeds[mask] = Tensor({1, 1, 32, 32}, 1);
  feeds["scale_mask"] = Tensor({1, 1, 1, 1}, 1), feeds["learning_rate"] = Tensor({}, 0), feeds["step"] = Tensor({}, 1);
  net.fill_states();
  std::map<std::string, Value> results(training.losses.begin(), training.losses.end());
  std::map<std::string, double> values;
  net.run(results, feeds, false);
  for (const auto& [name, value] : results) values[name] = net.result(name).real[0];
  return values;
}

TEST(Losses, TermsAreWeightedAndAddUp) {
  const auto plain = terms({}), weighted = terms({.albedo = 2, .normal = 0.5, .material = 0, .depth = 1, .scale = 3});
  double sum = 0;
  for (const auto& [name, value] : plain)
    if (name != "loss") sum += value;
  // Each term carries a few roundings of its own size.
  EXPECT_NEAR(plain.at("loss"), sum, 8 * 0x1p-23 * sum);
  EXPECT_EQ(weighted.count("material"), 0u);
  EXPECT_NEAR(weighted.at("albedo"), 2 * plain.at("albedo"), 4 * 0x1p-23 * plain.at("albedo"));
  EXPECT_NEAR(weighted.at("scale"), 3 * plain.at("scale"), 4 * 0x1p-23 * plain.at("scale"));
  EXPECT_THROW(terms({.albedo = 0, .normal = 0, .material = 0, .depth = 0, .scale = 0}), Error);
  const auto perceptual = terms({.perceptual = 0.02});
  EXPECT_GT(perceptual.at("albedo"), plain.at("albedo"));
  EXPECT_GT(perceptual.at("normal"), plain.at("normal"));
  EXPECT_GT(perceptual.at("material"), plain.at("material"));
  EXPECT_EQ(perceptual.at("depth"), plain.at("depth"));
}

}  // namespace
}  // namespace clerestory
