// ResNet34 against PyTorch on the same weights: levels, gradients, running statistics, inference.
#include "nets/resnet.hpp"

#include <gtest/gtest.h>

#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

constexpr Shape kImage{2, 3, 36, 44};  // odd sizes on the way down

Tensor golden_image() {
  Tensor image = formula("image", kImage);
  for (double& x : image.real) x += 0.5;
  return image;
}

/// Golden values are stored in float: 2^-24 of an element, and double's own rounding is far below.
constexpr double kStored = 0x1p-23;

TEST(Resnet, TrainsAsInPytorch) {
  for (const Precision precision : {Precision::Double, Precision::Single}) {
    GoldenNet net("resnet34.safetensors", precision);
    const Value image = net.graph.input("image", kImage);
    const std::vector<Value> levels = resnet({net.graph, true, ""}, image, {});
    std::map<std::string, Value> results;
    std::vector<Value> seeds;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      results["level" + std::to_string(i)] = levels[i];
      seeds.push_back(net.graph.constant(formula("cotangent" + std::to_string(i), levels[i].shape())));
    }
    std::vector<Value> wrt = net.graph.parameters();
    wrt.push_back(image);
    add_gradients(results, "gradient.", levels, seeds, wrt);
    net.fill_states();
    net.run(results, {{"image", golden_image()}}, true);
    int compared = 0;
    for (const auto& [name, tensor] : net.golden().tensors) {
      if (name.starts_with("inference")) continue;
      ++compared;
      if (precision == Precision::Single) {
        // As far as twice PyTorch's own float run lies from its double run: ReLUs that a rounding opens move gradients.
        const std::string kind = name.starts_with("level") ? "level" : name.starts_with("gradient") ? "gradient" : "";
        if (!kind.empty()) net.expect_norm(name, name, 2 * std::stod(net.golden().metadata.at("float_error_" + kind)));
      } else if (name.starts_with("state.")) {
        net.expect_state(name.substr(6), name, 2 * kStored);
      } else {
        net.expect_elements(name, name, 2 * kStored);
      }
    }
    EXPECT_GT(compared, 20);
  }
}

TEST(Resnet, InfersWithRunningStatistics) {
  GoldenNet net("resnet34.safetensors", Precision::Double);
  const Value image = net.graph.input("image", kImage);
  const std::vector<Value> trained = resnet({net.graph, true, ""}, image, {});
  net.fill_states();
  net.run({{"last", trained.back()}}, {{"image", golden_image()}}, true);  // PyTorch had taken one step before
  const std::vector<Value> levels = resnet({net.graph, false, ""}, image, {});
  std::map<std::string, Value> results;
  for (std::size_t i = 0; i < levels.size(); ++i) results["inference" + std::to_string(i)] = levels[i];
  net.run(results, {{"image", golden_image()}}, false);
  EXPECT_GE(results.size(), 4u);
  for (const auto& [name, value] : results) net.expect_elements(name, name, 2 * kStored);
}

TEST(Resnet, HasTorchvisionsParameters) {
  const auto parameters = [](int stages) {
    Graph graph;
    resnet({graph, true, ""}, graph.input("image", {1, 3, 32, 32}), {.stages = stages});
    long count = 0;
    for (const Value& v : graph.parameters()) count += v.shape().count();
    return count;
  };
  EXPECT_EQ(parameters(4), 21284672);  // torchvision's 21,797,672 less the classifier's 513,000
  EXPECT_EQ(parameters(3), 8170304);
  EXPECT_EQ(parameters(0), 64 * 3 * 49 + 2 * 64);
}

}  // namespace
}  // namespace clerestory
