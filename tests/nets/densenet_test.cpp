// DenseNet121 against PyTorch on the same weights: levels, gradients, running statistics, inference.
#include "nets/densenet.hpp"

#include <gtest/gtest.h>

#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

constexpr Shape kImage{2, 3, 32, 32};

Tensor golden_image() {
  Tensor image = formula("image", kImage);
  for (double& x : image.real) x += 0.5;
  return image;
}

/// Golden values are stored in float: 2^-24 of an element, and double's own rounding is far below.
constexpr double kStored = 0x1p-23;
/// How far float may lie from double: errors grow through 121 normalised layers, and ReLUs that a rounding opens or
/// closes move gradients by whole units. PyTorch's own float run, measured when the golden values were made, is the
/// yardstick; the worst tensor of the same kind, doubled as both draw such roundings at random.
double float_error(const GoldenNet& net, const std::string& kind) {
  return 2 * std::stod(net.golden().metadata.at("float_error_" + kind));
}

struct Network {
  GoldenNet net;
  std::map<std::string, Value> results;

  explicit Network(Precision precision) : net("densenet121.safetensors", precision) {
    const Value image = net.graph.input("image", kImage);
    const auto levels = densenet({net.graph, true, ""}, image, {});
    std::vector<Value> outputs, seeds;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      results["level" + std::to_string(i)] = levels[i];
      outputs.push_back(levels[i]);
      seeds.push_back(net.graph.constant(formula("cotangent" + std::to_string(i), levels[i].shape())));
    }
    std::vector<Value> wrt = net.graph.parameters();
    wrt.push_back(image);
    add_gradients(results, "gradient.", outputs, seeds, wrt);
    net.fill_states();
    net.run(results, {{"image", golden_image()}}, true);
  }
};

TEST(Densenet, TrainsAsInPytorchInDouble) {
  Network n(Precision::Double);
  int gradients = 0, states = 0;
  for (const auto& [name, tensor] : n.net.golden().tensors) {
    if (name.starts_with("inference")) continue;
    // Statistics of eight numbers and variances near epsilon amplify double's rounding by far less than float's 2^29.
    if (name.starts_with("state."))
      n.net.expect_state(name.substr(6), name, 2 * kStored), ++states;
    else
      n.net.expect_elements(name, name, 2 * kStored), gradients += name.starts_with("gradient");
  }
  EXPECT_GT(gradients, 20);
  EXPECT_GT(states, 4);
}

TEST(Densenet, TrainsAsInPytorchInFloat) {
  Network n(Precision::Single);
  int compared = 0;
  for (const auto& [name, tensor] : n.net.golden().tensors)
    for (const std::string kind : {"level", "gradient"})
      if (name.starts_with(kind)) n.net.expect_norm(name, name, float_error(n.net, kind)), ++compared;
  EXPECT_GT(compared, 20);
}

TEST(Densenet, InfersWithRunningStatistics) {
  GoldenNet net("densenet121.safetensors", Precision::Double);
  const Value image = net.graph.input("image", kImage);
  // PyTorch had taken one training step's statistics before: take the same here.
  const auto trained = densenet({net.graph, true, ""}, image, {});
  net.fill_states();
  net.run({{"last", trained.back()}}, {{"image", golden_image()}}, true);
  const auto levels = densenet({net.graph, false, ""}, image, {});
  std::map<std::string, Value> results;
  for (std::size_t i = 0; i < levels.size(); ++i) results["inference" + std::to_string(i)] = levels[i];
  net.run(results, {{"image", golden_image()}}, false);
  EXPECT_GE(results.size(), 4u);
  for (const auto& [name, value] : results) net.expect_elements(name, name, 2 * kStored);
}

TEST(Densenet, HasThePapersParameters) {
  Graph graph;
  densenet({graph, true, ""}, graph.input("image", {1, 3, 32, 32}), {});
  long count = 0;
  for (const Value& v : graph.parameters()) count += v.shape().count();
  EXPECT_EQ(count, 6953856);
}

}  // namespace
}  // namespace clerestory
