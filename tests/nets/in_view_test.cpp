// The light's networks against PyTorch on the same weights, and the paper's sizes by count.
#include "nets/in_view.hpp"

#include <gtest/gtest.h>

#include "host/error.hpp"
#include "nets/out_of_view.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

constexpr Shape kImage{2, 3, 20, 28};
constexpr int kRows = 5, kSamples = 16;
constexpr Shape kRays{1, 3, kRows, kSamples};
const ResnetSize kTrunk{.blocks = {1, 0, 0, 0}, .channels = {5, 0, 0, 0}, .stages = 1};

/// Golden values are stored in float: 2^-24 of an element, and double's own rounding is far below.
constexpr double kStored = 0x1p-23;

Tensor shifted(const std::string& name, const Shape& shape, double factor, double offset) {
  Tensor t = formula(name, shape);
  for (double& x : t.real) x = factor * x + offset;
  return t;
}

Tensor unit_directions(int picture) {
  Tensor d = formula("direction" + std::to_string(picture), kRays);
  for (int p = 0; p < kRows; ++p)
    for (int s = 0; s < kSamples; ++s) {
      double sum = 0;
      for (int c = 0; c < 3; ++c) sum += d.at(0, c, p, s) * d.at(0, c, p, s);
      for (int c = 0; c < 3; ++c) d.at(0, c, p, s) /= std::sqrt(sum);
    }
  return d;
}

Tensor hits(int picture) {
  const Tensor u = formula("hit" + std::to_string(picture), {1, 1, kRows, kSamples});
  Tensor hit = Tensor::of_int({1, 1, kRows, kSamples}, std::vector<int>(kRows * kSamples));
  for (std::size_t i = 0; i < hit.integer.size(); ++i)
    hit.integer[i] = static_cast<int>((u.real[i] + 0.5) * kImage.plane());
  return hit;
}

/// Radiance of both pictures and all gradients beside the golden ones whose names begin with `label`.
void expect_golden(GoldenNet& net, const std::string& label, const std::vector<Value>& radiance, Precision precision) {
  std::map<std::string, Value> results;
  std::vector<Value> seeds;
  for (std::size_t n = 0; n < 2; ++n) {
    results[label + ".radiance" + std::to_string(n)] = radiance[n];
    seeds.push_back(net.graph.constant(formula("cotangent" + std::to_string(n), kRays)));
  }
  add_gradients(results, label + ".gradient.", radiance, seeds, net.graph.parameters());
  net.fill_states();
  net.run(results, {{"image", shifted("image", kImage, 1, 0.5)}}, false);
  int compared = 0;
  for (const auto& [name, tensor] : net.golden().tensors) {
    if (!name.starts_with(label + ".")) continue;
    ++compared;
    ASSERT_TRUE(results.count(name)) << name;
    if (precision == Precision::Double)
      net.expect_elements(name, name, 2 * kStored);
    else  // ReLUs that a rounding opens move gradients: a net of a few channels has few to average over
      net.expect_norm(name, name, name.find("gradient") == std::string::npos ? 1e-4 : 2e-2);
  }
  EXPECT_EQ(compared, static_cast<int>(results.size()));
}

InViewSize small(int width, int layers, int again, LightOutput output) {
  return {.trunk = kTrunk,
          .frequencies = 6,
          .width = width,
          .layers = layers,
          .again = again,
          .output = output,
          .log_input = output == LightOutput::Residual};
}

void expect_in_view(const std::string& label, const InViewSize& size) {
  for (const Precision precision : {Precision::Double, Precision::Single}) {
    GoldenNet net("light.safetensors", precision);
    const Value image = net.graph.input("image", kImage);
    const Shape& s = kImage;
    const auto map = [&](const char* name, int channels, double offset) {
      return net.graph.constant(shifted(name, {s.n, channels, s.h, s.w}, 1, offset));
    };
    const Surfaces surfaces{map("albedo", 3, 0.5), map("normal", 3, 0), map("material", 3, 0.5)};
    const Scope scope{net.graph, true, ""};
    const std::vector<LightPixels> pixels = light_pixels_of_batch(scope, image, surfaces, size);
    std::vector<Value> radiance;
    for (int n = 0; n < 2; ++n)
      radiance.push_back(in_view_light(scope, pixels[static_cast<std::size_t>(n)], net.graph.constant(hits(n)),
                                       net.graph.constant(unit_directions(n)), item_of(image, n), size));
    expect_golden(net, label, radiance, precision);
  }
}

TEST(LightNet, ResidualIsPytorchs) { expect_in_view("in_view_residual", small(7, 3, 0, LightOutput::Residual)); }
TEST(LightNet, ReleasedIsPytorchs) { expect_in_view("in_view_released", small(8, 4, 2, LightOutput::Released)); }
TEST(LightNet, SoftplusIsPytorchs) { expect_in_view("in_view_softplus", small(6, 2, 0, LightOutput::Softplus)); }
TEST(LightNet, ExpIsPytorchs) { expect_in_view("in_view_exp", small(6, 2, 1, LightOutput::Exp)); }

/// What a field that does not see maps reads.
LightInputs photograph_alone(Value image) { return {image, {}, {}, {}, {}}; }

void expect_out_of_view(const std::string& label, bool paper) {
  const OutOfViewSize size{.trunk = kTrunk,
                           .hyper = paper ? HyperNet::Paper : HyperNet::LowRank,
                           .stem = 12,
                           .inner = 10,
                           .rank = 2,
                           .octaves = 3,
                           .hidden = {7, 6},
                           .march = {.segments = 9, .jitter = false},
                           .released_output = paper,
                           .log_input = !paper};
  for (const Precision precision : {Precision::Double, Precision::Single}) {
    GoldenNet net("light.safetensors", precision);
    const Scope scope{net.graph, true, ""};
    const std::vector<LightField> fields =
        light_fields(scope, photograph_alone(net.graph.input("image", kImage)), size);
    const Value range = net.graph.constant(Tensor(Shape{1, 3, 1, 1}, 2.5));
    std::vector<Value> radiance;
    for (int n = 0; n < 2; ++n) {
      const Value points = net.graph.constant(shifted("point" + std::to_string(n), kRays, 4, 0));
      radiance.push_back(out_of_view_light(fields[static_cast<std::size_t>(n)], points,
                                           net.graph.constant(unit_directions(n)), range, size));
    }
    expect_golden(net, label, radiance, precision);
  }
}

TEST(OutOfView, PapersHypernetworkIsPytorchs) { expect_out_of_view("out_of_view_paper", true); }
TEST(OutOfView, LowRankIsPytorchs) { expect_out_of_view("out_of_view_low_rank", false); }

long parameters_under(const Graph& graph, const std::string& name) {
  long count = 0;
  for (const Value& v : graph.parameters())
    if (static_cast<const StateOp&>(*v.node->op).state_name.starts_with(name)) count += v.shape().count();
  return count;
}

TEST(LightNet, PaperHasTheReleasedCounts) {
  Graph graph;
  const Scope scope{graph, false, "local"};
  const Shape s{1, 3, 32, 32};
  const Value image = graph.input("image", s);
  const InViewSize size = in_view_size("paper");
  const LightPixels pixels =
      light_pixels(scope, image, {image, graph.input("normal", s), graph.input("material", s)}, size);
  in_view_light(scope, pixels, graph.input("hit", {1, 1, 2, 16}, Type::Int), graph.input("direction", {1, 3, 2, 16}),
                image, size);
  EXPECT_EQ(parameters_under(graph, "local.encoder"), 8170304);
  // 1152 x 512, seven of 512 x 512, one of 1664 x 512, 512 x 3, with biases.
  EXPECT_EQ(parameters_under(graph, "local.mlp"), 3282947);
}

TEST(OutOfView, PaperHasTheReleasedCounts) {
  Graph graph;
  const OutOfViewSize size = out_of_view_size("paper");
  const LightField field =
      light_fields({graph, false, "global"}, photograph_alone(graph.input("image", {1, 3, 64, 64})), size)[0];
  long numbers = 0;
  for (const auto* values : {&field.weights, &field.biases})
    for (const Value& value : *values) numbers += value.shape().count();
  EXPECT_EQ(numbers, 11140);
  const long weights = parameters_under(graph, "global.hyper.weights"),
             biases = parameters_under(graph, "global.hyper.biases");
  // As they are stated, in tenths of a million.
  EXPECT_NEAR(static_cast<double>(weights), 130.3e6, 0.05e6);
  EXPECT_NEAR(static_cast<double>(biases), 86.3e6, 0.05e6);
}

TEST(LightNet, CompactKeepsToItsBudget) {
  Graph graph;
  const Scope local{graph, false, "local"}, global{graph, false, "global"};
  const Shape s{1, 3, 64, 64};
  const Value image = graph.input("image", s);
  const InViewSize in_view = in_view_size("compact");
  const LightPixels pixels =
      light_pixels(local, image, {image, graph.input("normal", s), graph.input("material", s)}, in_view);
  in_view_light(local, pixels, graph.input("hit", {1, 1, 2, 16}, Type::Int), graph.input("direction", {1, 3, 2, 16}),
                image, in_view);
  light_fields(global, photograph_alone(image), out_of_view_size("compact"));
  EXPECT_LE(parameters_under(graph, "global.hyper"), 2'000'000);
  EXPECT_LE(parameters_under(graph, "local") + parameters_under(graph, "global"), 9'000'000);
}

TEST(LightNet, NamesAreChecked) {
  EXPECT_THROW(in_view_size("large"), Error);
  EXPECT_THROW(out_of_view_size("large"), Error);
  EXPECT_THROW(light_output_of("tanh"), Error);
  EXPECT_EQ(light_output_of("softplus"), LightOutput::Softplus);
}

}  // namespace
}  // namespace clerestory
