// MGNet against PyTorch on the same weights, its sizes, and what one training step promises.
#include <gtest/gtest.h>

#include <cmath>

#include "nets/mgnet_training.hpp"
#include "tests/least_memory.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

long parameters_of(const std::string& preset) {
  Graph graph;
  mgnet(graph, graph.input("image", {1, 3, 64, 64}), mgnet_size(preset), true);
  long count = 0;
  for (const Value& v : graph.parameters())
    if (!static_cast<const StateOp&>(*v.node->op).state_name.starts_with("scale.")) count += v.shape().count();
  return count;
}

TEST(Mgnet, HasThePapersParameters) {
  EXPECT_EQ(parameters_of("paper"), 38528075);
  EXPECT_LE(parameters_of("compact"), 16000000);
  EXPECT_LE(parameters_of("shared"), parameters_of("compact"));
  EXPECT_THROW(mgnet_size("huge"), Error);
}

void expect_maps_of_size(const std::string& preset) {
  for (const auto& [h, w] : {std::pair{64, 96}, std::pair{50, 70}, std::pair{33, 47}}) {
    Graph graph;
    const Maps maps = mgnet(graph, graph.input("image", {2, 3, h, w}), mgnet_size(preset), false);
    EXPECT_EQ(maps.albedo.shape(), (Shape{2, 3, h, w}));
    EXPECT_EQ(maps.material.shape(), (Shape{2, 2, h, w}));
    EXPECT_EQ(maps.normal.shape(), (Shape{2, 3, h, w}));
    EXPECT_EQ(maps.depth.shape(), (Shape{2, 1, h, w}));
    EXPECT_EQ(maps.log_scale.shape(), (Shape{2, 1, 1, 1}));
  }
}

TEST(Mgnet, MapsHaveTheImagesSizeWhateverItIs) {
  for (const char* preset : {"compact", "shared", "lite"}) expect_maps_of_size(preset);
}

TEST(Mgnet, EveryParameterHasAGradientOrIsFrozen) {
  const auto frozen = [](LossWeights weights, const char* preset = "compact") {
    Graph graph;
    MgnetTrainingOptions options{.batch = 1, .height = 64, .width = 64};
    options.weights = weights;
    return mgnet_training(graph, mgnet_size(preset), options).frozen;
  };
  using Scopes = std::vector<std::string>;
  LossWeights weights;
  EXPECT_EQ(frozen(weights), Scopes{});
  weights.albedo = 0;
  EXPECT_EQ(frozen(weights), Scopes{"decoder_albedo"});
  weights.material = 0, weights.metallic = 1;
  EXPECT_EQ(frozen(weights), Scopes{"decoder_albedo"});
  weights.normal = weights.metallic = 0;
  EXPECT_EQ(frozen(weights), (Scopes{"decoder_albedo", "decoder_normal", "decoder_material"}));
  weights.depth = 0;
  EXPECT_EQ(frozen(weights),
            (Scopes{"decoder_albedo", "decoder_normal", "decoder_material", "decoder_depth", "encoder"}));
  EXPECT_EQ(frozen(weights, "shared"),
            (Scopes{"decoder_albedo", "decoder_normal", "decoder_material", "decoder_depth", "decoder", "encoder"}));
  weights.depth_detail = 1, weights.albedo_detail = 1;
  EXPECT_EQ(frozen(weights), (Scopes{"decoder_normal", "decoder_material"}));
  weights.depth_detail = weights.albedo_detail = 0;
  weights.depth = 1, weights.scale = 0;
  EXPECT_EQ(frozen(weights, "shared"), (Scopes{"decoder_albedo", "decoder_normal", "decoder_material", "scale"}));
  EXPECT_EQ(frozen(weights), (Scopes{"decoder_albedo", "decoder_normal", "decoder_material", "scale"}));
}

constexpr int kBatch = 2, kHeight = 40, kWidth = 56;

std::map<std::string, Tensor> golden_batch() {
  std::map<std::string, Tensor> feeds = golden_maps(kBatch, kHeight, kWidth);
  feeds["log_scale"] = formula("log_scale", {kBatch, 1, 1, 1});
  for (double& x : feeds["log_scale"].real) x += 1.5;
  feeds["scale_mask"] = Tensor({kBatch, 1, 1, 1}, 1);
  feeds["learning_rate"] = Tensor({}, 5e-4), feeds["step"] = Tensor({}, 1);
  return feeds;
}

void expect_training_as_in_pytorch(const std::string& preset) {
  GoldenNet net("mgnet_" + preset + ".safetensors", Precision::Double);
  const MgnetTraining training =
      mgnet_training(net.graph, mgnet_size(preset), {.batch = kBatch, .height = kHeight, .width = kWidth});
  const Maps& maps = training.maps;
  std::map<std::string, Value> results{{"map.albedo", maps.albedo},
                                       {"map.material", maps.material},
                                       {"map.normal", maps.normal},
                                       {"map.depth", maps.depth},
                                       {"map.log_scale", maps.log_scale}};
  for (const auto& [name, value] : training.losses) results["loss." + name] = value;
  const std::vector<Value> loss{training.losses.front().second}, one{net.graph.fill({}, 1)};
  add_gradients(results, "gradient.", loss, one, net.graph.parameters());
  net.fill_states();
  net.run(results, golden_batch(), false);
  int compared = 0;
  for (const auto& [name, tensor] : net.golden().tensors) {
    // Stored in float. A bias before a normalisation over its own channel alone has a gradient of zero in exact
    // arithmetic; none is among these (groups hold several channels).
    net.expect_elements(name, name, 0x1p-22);
    ++compared;
  }
  EXPECT_GT(compared, mgnet_size(preset).shared() ? 50 : 80);  // one decoder in place of four
}

TEST(Mgnet, TrainsAsInPytorchInDouble) { expect_training_as_in_pytorch("compact"); }
TEST(Mgnet, SharedTrainsAsInPytorchInDouble) { expect_training_as_in_pytorch("shared"); }
TEST(Mgnet, LiteTrainsAsInPytorchInDouble) { expect_training_as_in_pytorch("lite"); }

// Adam's first step is as long as the rate, whatever the gradient.
TEST(Mgnet, TheEncoderMovesAtARateOfItsOwn) {
  const Device device = Device::open();
  for (const double factor : {0.0, 0.25}) {
    Graph graph;
    const MgnetTraining training = mgnet_training(
        graph, mgnet_size("lite"), {.batch = kBatch, .height = kHeight, .width = kWidth, .encoder_rate = factor});
    const auto states = std::make_shared<States>(device);
    states->initialise(graph, 7);
    const std::vector<std::string> watched{"encoder.stage2.0.depthwise.bias", "decoder.c5.conv.weight"};
    std::vector<Tensor> before;
    for (const std::string& name : watched) before.push_back(states->get(name));
    Executor run(compile(graph, {training.losses.front().second}, device, {}, true), states);
    for (const auto& [name, tensor] : golden_batch()) run.feed(name, tensor);
    run.run();
    for (std::size_t k = 0; k < watched.size(); ++k) {
      const double step = (k == 0 ? factor : 1) * 5e-4;
      double moved = 0;
      const Tensor after = states->get(watched[k]);
      for (std::size_t i = 0; i < after.real.size(); ++i)
        moved = std::max(moved, std::abs(after.real[i] - before[k].real[i]));
      // Weights near 1 are rounded to 6e-8, half a permille of the shorter step.
      EXPECT_NEAR(moved, step, 1e-3 * step) << watched[k];
    }
  }
}

/// Losses of three steps and every state after them, running statistics and moments included.
std::vector<std::vector<double>> trained_within(const Graph& graph, const MgnetTraining& training,
                                                const PlanOptions& options) {
  const Device device = Device::open();
  const auto states = std::make_shared<States>(device);
  states->initialise(graph, 7);
  const Value loss = training.losses.front().second;
  Executor run(compile(graph, {loss}, device, options, true), states);
  for (const auto& [name, tensor] : golden_batch()) run.feed(name, tensor);
  std::vector<std::vector<double>> values;
  for (int step = 1; step <= 3; ++step) {
    run.feed("step", Tensor({}, step));
    run.run();
    values.push_back(run.fetch(loss).real);
  }
  for (const std::string& name : states->names()) values.push_back(states->get(name).real);
  return values;
}

TEST(Mgnet, StepsWithinABudgetEndInTheSameBits) {
  for (const char* preset : {"compact", "shared", "lite"}) {
    Graph graph;
    const MgnetTraining training =
        mgnet_training(graph, mgnet_size(preset), {.batch = kBatch, .height = kHeight, .width = kWidth});
    const std::vector<Value> outputs{training.losses.front().second};
    const std::size_t whole = compile(graph, outputs, Device::open(), {}, true).memory().total();
    const std::size_t least = least_memory(graph, outputs, Device::open(), true);
    EXPECT_LT(least, whole) << preset;
    EXPECT_EQ(trained_within(graph, training, {.budget = least}), trained_within(graph, training, {.reorder = false}))
        << preset;
  }
}

/// Steps in one go, and in two with states carried over, agree bit for bit; and the loss falls.
TEST(Mgnet, GoesOnFromItsStatesBitForBit) {
  Graph graph;
  const MgnetTraining training =
      mgnet_training(graph, mgnet_size("compact"), {.batch = kBatch, .height = 32, .width = 32});
  const Device device = Device::open();
  const Plan plan = compile(graph, {training.losses.front().second}, device, {}, true);
  const auto steps = [&](const std::shared_ptr<States>& states, int first, int last) {
    Executor run(plan, states);
    double loss = 0;
    for (auto [name, tensor] : golden_batch()) {
      if (tensor.shape.h > 1) {
        Tensor small({tensor.shape.n, tensor.shape.c, 32, 32});
        std::copy_n(tensor.real.begin(), small.real.size(), small.real.begin());
        tensor = small;
      }
      run.feed(name, tensor);
    }
    for (int i = first; i <= last; ++i) {
      run.feed("step", Tensor({}, i));
      run.run();
      loss = run.fetch(training.losses.front().second).real[0];
    }
    return loss;
  };
  const auto fresh = [&] {
    auto states = std::make_shared<States>(device);
    states->initialise(graph, 7);
    return states;
  };
  const auto whole = fresh(), parts = fresh(), copied = fresh();
  const double first_loss = steps(fresh(), 1, 1), last_loss = steps(whole, 1, 6);
  EXPECT_LT(last_loss, first_loss);
  steps(parts, 1, 3);
  for (const std::string& name : parts->names()) copied->set(name, parts->get(name));
  steps(copied, 4, 6);
  for (const std::string& name : whole->names())
    ASSERT_EQ(whole->get(name).real, copied->get(name).real) << name << " differs after the break";
}

}  // namespace
}  // namespace clerestory
