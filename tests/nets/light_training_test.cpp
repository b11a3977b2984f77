// A training step of the light: its loss by definition, and that steps on a known room lower every term.
#include "nets/light_training.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/math/camera.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "tests/least_memory.hpp"
#include "tests/nets/golden.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

/// Numbers from 5e-5 to 2e4.
Tensor wide(const std::string& name, const Shape& shape) {
  Tensor t = formula(name, shape);
  for (double& x : t.real) x = std::exp(20 * x);
  return t;
}

/// A loss of `prediction` in double, and its gradient.
template <class Loss>
std::vector<Tensor> loss_and_slope(const Tensor& prediction, const Loss& loss) {
  Graph graph;
  const Value p = graph.input("prediction", prediction.shape), value = loss(graph, p);
  return evaluate(graph, {value, gradient(value, std::vector<Value>{p}).front()}, device_for(Precision::Double),
                  {{"prediction", prediction}}, {.precision = Precision::Double});
}

TEST(LightTraining, HdrLossAgainstItsDefinitionAndGradient) {
  constexpr Shape kRays{1, 3, 4, 16}, kOne{1, 1, 4, 16};
  constexpr std::size_t rays = 64;
  Tensor prediction = wide("prediction", kRays), truth = wide("truth", kRays), mask = formula("mask", kOne);
  prediction.real[0] = 0, truth.real[1] = 0;
  for (double& m : mask.real) m = m > -0.3;
  mask.real[0] = mask.real[1] = 1;
  double loss = 0, count = 0;
  for (std::size_t i = 0; i < rays; ++i) count += mask.real[i];
  std::vector<double> slope(3 * rays);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < rays; ++i) {
      const double scale = prediction.real[c * rays + i] + 1e-3;
      const double e = (prediction.real[c * rays + i] - truth.real[c * rays + i]) / scale;
      loss += mask.real[i] * e * e / (3 * count);
      slope[c * rays + i] = mask.real[i] * 2 * e / scale / (3 * count);
    }
  const std::vector<Tensor> results = loss_and_slope(
      prediction, [&](Graph& graph, Value p) { return hdr_loss(p, graph.constant(truth), graph.constant(mask)); });
  // The scale goes through a logarithm of at most 10 and back: 10 units in the last place.
  EXPECT_NEAR(results[0].real[0], loss, 1e-12 * loss);
  for (std::size_t i = 0; i < slope.size(); ++i)
    EXPECT_NEAR(results[1].real[i], slope[i], 1e-12 * std::abs(slope[i])) << i;
}

TEST(LightTraining, IrradianceLossAgainstItsDefinitionAndGradient) {
  constexpr Shape kRays{1, 3, 4, 16};
  constexpr std::size_t rows = 12, samples = 16;  // rows of every channel
  Tensor prediction = wide("prediction", kRays), truth = wide("truth", kRays);
  for (std::size_t i = 0; i < samples; ++i) prediction.real[i] = truth.real[samples + i] = 0;  // a dark row of each
  double loss = 0, sizes = 0;
  std::vector<double> slope(rows * samples);
  for (std::size_t r = 0; r < rows; ++r) {
    double ours = 0, theirs = 0;
    for (std::size_t i = r * samples; i < (r + 1) * samples; ++i)
      ours += prediction.real[i] / samples, theirs += truth.real[i] / samples;
    ours += 0.01, theirs += 0.01;
    loss += (theirs * std::log(theirs / ours) - theirs + ours) / rows, sizes += (ours + theirs) / rows;
    for (std::size_t i = 0; i < samples; ++i) slope[r * samples + i] = (1 - theirs / ours) / (rows * samples);
  }
  const std::vector<Tensor> results =
      loss_and_slope(prediction, [&](Graph& graph, Value p) { return irradiance_loss(p, graph.constant(truth)); });
  // Sums of 16, and differences of what is as large as they are: logarithms here are below 10.
  EXPECT_NEAR(results[0].real[0], loss, 10 * 32 * kDoubleRounding * sizes);
  for (std::size_t i = 0; i < slope.size(); ++i)
    EXPECT_NEAR(results[1].real[i], slope[i], 32 * kDoubleRounding * (1.0 / (rows * samples) + std::abs(slope[i])))
        << i;
}

// Of light that may be one or the other the loss of logarithms prefers the geometric mean, this one the mean.
TEST(LightTraining, IrradianceIsRightInTheMean) {
  const Shape rays{1, 3, 2, 16};
  Tensor truth(rays, 0.1);  // one row dark, one bright
  for (int c = 0; c < 3; ++c)
    for (int s = 0; s < 16; ++s) truth.at(0, c, 1, s) = 10;
  const auto slope_at = [&](double level) {
    Graph graph;
    const Value p = graph.input("level", {});
    const Value value = irradiance_loss(expand(p, rays), graph.constant(truth));
    return evaluate(graph, {gradient(value, std::vector<Value>{p}).front()}, device_for(Precision::Double),
                    {{"level", Tensor({}, level)}}, {.precision = Precision::Double})[0]
        .real[0];
  };
  EXPECT_LT(slope_at(1), 0);                                 // the geometric mean is too dark
  EXPECT_NEAR(slope_at(5.05), 0, 2 * 96 * kDoubleRounding);  // the sum of 96 slopes of at most 1 / 96 each
  EXPECT_NEAR(slope_at(0) * 0.01, 0.01 - 5.06, 1e-9) << "along its logarithm: as much as there is light, no more";
  EXPECT_GT(slope_at(6), 0);
}

TEST(LightTraining, RelativeLossAgainstItsDefinitionAndDifferences) {
  constexpr Shape kRays{1, 3, 4, 16}, kOne{1, 1, 4, 16};
  constexpr std::size_t rays = 64;
  Tensor prediction = wide("prediction", kRays), truth = wide("truth", kRays), mask = formula("mask", kOne);
  prediction.real[0] = 0, truth.real[1] = 0;
  for (double& m : mask.real) m = m > -0.3;
  mask.real[0] = mask.real[1] = 1;
  double count = 0;
  for (std::size_t i = 0; i < rays; ++i) count += mask.real[i];
  const auto loss_of = [&](double y, double t) {
    const double l = std::log((y + 0.01) / (t + 0.01));
    return l * l + 0.25 * (y - t) * (y - t) / (t * t + 0.01);
  };
  double loss = 0;
  for (std::size_t i = 0; i < 3 * rays; ++i)
    loss += mask.real[i % rays] * loss_of(prediction.real[i], truth.real[i]) / (3 * count);
  const std::vector<Tensor> results = loss_and_slope(
      prediction, [&](Graph& graph, Value p) { return relative_loss(p, graph.constant(truth), graph.constant(mask)); });
  EXPECT_NEAR(results[0].real[0], loss, 1e-12 * loss);
  for (std::size_t i = 0; i < 3 * rays; ++i) {
    const double y = prediction.real[i], t = truth.real[i], step = 1e-6 * (y + 0.01);
    const double slope = mask.real[i % rays] * (loss_of(y + step, t) - loss_of(y - step, t)) / (2 * step) / (3 * count);
    // A difference loses epsilon |loss| / step.
    EXPECT_NEAR(results[1].real[i], slope, 1e-7 * std::abs(slope) + 1e-15 * loss_of(y, t) / step) << i;
  }
  EXPECT_EQ(radiance_loss_of("relative"), RadianceLoss::Relative);
  EXPECT_THROW(radiance_loss_of("l1"), Error);
}

/// A wall two metres away under a light that depends on direction alone.
struct Wall {
  static constexpr int kHeight = 24, kWidth = 32, kShadeHeight = 6, kShadeWidth = 8;
  LightTrainingOptions options{.batch = 2,
                               .height = kHeight,
                               .width = kWidth,
                               .rows = 8,
                               .samples = 16,
                               .shade_height = kShadeHeight,
                               .shade_width = kShadeWidth,
                               .weights = {.rerender = 1}};
  std::map<std::string, Tensor> feeds;

  Wall() {
    const int n = options.batch;
    put_maps("", kHeight, kWidth), put_maps("shade_", kShadeHeight, kShadeWidth);
    feeds["image"] = shifted("image", {n, 3, kHeight, kWidth}, 0.5);
    feeds["shade_image"] = feeds["shade_albedo"];  // what a light of 2 from behind the camera makes of it, about
    for (double& x : feeds["shade_image"].real) x *= 2;
    feeds["shade_mask"] = Tensor({n, 1, kShadeHeight, kShadeWidth}, 1);
    feeds["range"] = Tensor(Shape{n, 3, 1, 1}, 2.0);
    feeds["learning_rate"] = Tensor({}, 2e-3), feeds["step"] = Tensor({}, 1);
    const int count = kShadeHeight * kShadeWidth;
    for (int b = 0; b < n; ++b) {
      const std::string at = std::to_string(b);
      put_rays(at);
      feeds["shade_skip" + at] = Tensor::of_int({1, 1, count, options.shade_samples},
                                                std::vector<int>(static_cast<std::size_t>(count) * 16, -1));
    }
  }

  Tensor shifted(const std::string& name, const Shape& shape, double offset) {
    Tensor t = formula(name, shape);
    for (double& x : t.real) x += offset;
    return t;
  }

  void put_maps(const std::string& prefix, int h, int w) {
    const int n = options.batch;
    Tensor normal({n, 3, h, w}), material({n, 3, h, w});
    for (int b = 0; b < n; ++b)
      for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) normal.at(b, 2, y, x) = 1, material.at(b, 0, y, x) = 0.5;
    feeds[prefix + "normal"] = normal, feeds[prefix + "material"] = material;
    feeds[prefix + "albedo"] = shifted("albedo", {n, 3, h, w}, 0.5);
    feeds[prefix + "depth"] = Tensor(Shape{n, 1, h, w}, 2.0);
    const std::vector<Camera> cameras(static_cast<std::size_t>(n), Camera::from_fov(w, h, 60));
    feeds[prefix + "camera"] = camera_tensor(cameras);
  }

  /// Half of the rays go towards the wall from near the camera, the others away from it.
  void put_rays(const std::string& at) {
    const Shape three{1, 3, options.rows, options.samples}, one{1, 1, options.rows, options.samples};
    Tensor points = formula("points" + at, three), directions = formula("directions" + at, three), light(three);
    for (int p = 0; p < options.rows; ++p)
      for (int s = 0; s < options.samples; ++s) {
        points.at(0, 2, p, s) = -1;
        directions.at(0, 2, p, s) = p % 2 ? 1 : -1;
        double sum = 0;
        for (int c = 0; c < 3; ++c) sum += std::pow(directions.at(0, c, p, s), 2);
        for (int c = 0; c < 3; ++c) {
          directions.at(0, c, p, s) /= std::sqrt(sum);
          light.at(0, c, p, s) = p % 2 ? 2 : 0.3;
        }
      }
    feeds["points" + at] = points, feeds["directions" + at] = directions, feeds["light" + at] = light;
    feeds["known" + at] = Tensor(one, 1);
    feeds["skip" + at] = Tensor::of_int(one, std::vector<int>(static_cast<std::size_t>(one.count()), -1));
  }
};

LightSizes small_sizes() {
  LightSizes sizes = light_sizes("compact");
  InViewSize& in_view = sizes.in_view;
  OutOfViewSize& far = sizes.out_of_view;
  in_view.trunk = {.blocks = {1, 1, 0, 0}, .channels = {8, 8, 0, 0}, .stages = 2};
  in_view.frequencies = 4, in_view.width = 16, in_view.layers = 2;
  far.trunk = in_view.trunk, far.stem = 16, far.hidden = {16}, far.march.segments = 8;
  return sizes;
}

/// The losses of every step.
std::vector<std::map<std::string, double>> trained(const Graph& graph, const LightTraining& training, const Wall& wall,
                                                   int steps, const PlanOptions& options = {}) {
  std::vector<Value> outputs;
  for (const auto& [name, value] : training.losses) outputs.push_back(value);
  const Device device = Device::open();
  const auto states = std::make_shared<States>(device);
  states->initialise(graph, 7);
  Executor executor(compile(graph, outputs, device, options, true), states);
  for (const auto& [name, tensor] : wall.feeds) executor.feed(name, tensor);
  std::vector<std::map<std::string, double>> curve;
  for (int i = 1; i <= steps; ++i) {
    executor.feed("step", Tensor({}, i));
    executor.run(static_cast<std::uint32_t>(i));
    curve.emplace_back();
    for (const auto& [name, value] : training.losses) curve.back()[name] = executor.fetch(value).real[0];
  }
  return curve;
}

void expect_every_term_falls(RadianceLoss radiance) {
  Wall wall;
  wall.options.radiance = radiance;
  Graph graph;
  const LightTraining training = light_training(graph, small_sizes(), wall.options);
  const auto curve = trained(graph, training, wall, 40);
  for (const auto& [name, value] : training.losses) {
    EXPECT_GT(curve.front().at(name), 0) << name;
    EXPECT_LT(curve.back().at(name), 0.7 * curve.front().at(name)) << name << " was not trained";
  }
  double sum = 0;
  for (const char* name : {"mixed", "out_of_view", "rerender"}) sum += curve[0].at(name);
  EXPECT_NEAR(curve[0].at("loss"), sum, 4 * 0x1p-23 * sum);
  EXPECT_EQ(trained(graph, training, wall, 3).back(), curve[2]) << "the same steps end in other bits";
}

TEST(LightTraining, StepsLowerEveryTerm) { expect_every_term_falls(RadianceLoss::Hdr); }
TEST(LightTraining, StepsLowerEveryRelativeTerm) { expect_every_term_falls(RadianceLoss::Relative); }

// What draws at random draws the same when it is computed again.
TEST(LightTraining, StepsWithinABudgetEndInTheSameBits) {
  Wall wall;
  Graph graph;
  const LightTraining training = light_training(graph, small_sizes(), wall.options);
  std::vector<Value> outputs;
  for (const auto& [name, value] : training.losses) outputs.push_back(value);
  const std::size_t whole = compile(graph, outputs, Device::open(), {}, true).memory().total();
  const std::size_t least = least_memory(graph, outputs, Device::open(), true);
  EXPECT_LT(least, whole);
  EXPECT_EQ(trained(graph, training, wall, 3, {.budget = least}),
            trained(graph, training, wall, 3, {.reorder = false}));
}

// Pictures that are equal to the last bit, and rays that are: what is drawn at random for one is not what is drawn for
// the other. Directions of the pixels that are rendered again, and places along rays through the field.
TEST(LightTraining, PicturesOfABatchDrawTheirOwnSamples) {
  Wall wall;
  wall.feeds["shade_albedo"] = Tensor(wall.feeds["shade_albedo"].shape, 0.5);
  wall.feeds["points1"] = wall.feeds["points0"], wall.feeds["directions1"] = wall.feeds["directions0"];
  LightSizes sizes = small_sizes();
  sizes.out_of_view.form = OutOfViewForm::Field;
  Graph graph;
  light_training(graph, sizes, wall.options);
  std::vector<Value> drawn, marched;
  for (const Node& node : graph.nodes()) {
    if (node.op->name() == "sample_brdf") drawn.push_back(node.value());
    if (node.op->name() == "march") marched.push_back(node.value());  // of each picture: rays, rays of its pixels
  }
  ASSERT_EQ(drawn.size(), 2u);
  ASSERT_EQ(marched.size(), 4u);
  const Device device = Device::open();
  const auto states = std::make_shared<States>(device);
  states->initialise(graph, 7);
  const std::vector<Tensor> values =
      evaluate(graph, {drawn[0], drawn[1], marched[0], marched[2]}, device, wall.feeds, {}, 5, states);
  for (const std::size_t first : {0, 2}) {
    const std::vector<double>&a = values[first].real, &b = values[first + 1].real;
    std::size_t equal = 0;
    for (std::size_t i = 0; i < a.size(); ++i) equal += a[i] == b[i];
    EXPECT_LT(equal, a.size() / 100) << (first ? "marched" : "drawn") << ": of " << a.size();
  }
}

TEST(LightTraining, EveryParameterHasAGradientOrIsFrozen) {
  Wall wall;
  const auto frozen = [&](const LightLossWeights& weights) {
    wall.options.weights = weights;
    Graph graph;
    return light_training(graph, small_sizes(), wall.options).frozen;
  };
  using Scopes = std::vector<std::string>;
  EXPECT_EQ(frozen({1, 1, 1}), Scopes{});
  EXPECT_EQ(frozen({1, 0, 0}), Scopes{});
  EXPECT_EQ(frozen({0, 0, 1}), Scopes{});
  EXPECT_EQ(frozen({0, 1, 0}), Scopes{"local"});
  EXPECT_EQ(frozen({.mixed = 0, .out_of_view = 0, .rerender = 0, .unseen = 1}), Scopes{"local"});
}

// What is not seen is the out-of-view part on rays that count by their u.
TEST(LightTraining, UnseenIsOutOfViewWhereTheUncertaintySaysWhatIsKnown) {
  Wall wall;
  std::erase_if(wall.feeds, [](const auto& feed) { return feed.first.starts_with("shade_"); });
  const auto first_loss = [&](const LightLossWeights& weights) {
    wall.options.weights = weights;
    Graph graph;
    return trained(graph, light_training(graph, small_sizes(), wall.options), wall, 1)[0].at("loss");
  };
  const double unseen = first_loss({.mixed = 0, .out_of_view = 0, .rerender = 0, .unseen = 1});
  EXPECT_NE(unseen, first_loss({.mixed = 0, .out_of_view = 1, .rerender = 0}));
  double least = 1, most = 0;
  for (int b = 0; b < wall.options.batch; ++b) {
    const std::string at = std::to_string(b);
    Graph graph;
    std::map<std::string, Tensor> feeds;
    const auto input = [&](const std::string& name, Type type = Type::Real) {
      feeds[name] = wall.feeds.at(name);
      return graph.input(name, wall.feeds.at(name).shape, type);
    };
    const SsrtHits hits =
        ssrt(ssrt_scene(item_of(input("depth"), b)), item_of(input("camera"), b), item_of(input("range"), b),
             input("directions" + at), {input("points" + at), input("skip" + at, Type::Int)});
    Tensor& known = wall.feeds["known" + at] = evaluate(graph, {hits.u}, Device::open(), feeds)[0];
    least = std::min(least, std::ranges::min(known.real)), most = std::max(most, std::ranges::max(known.real));
  }
  EXPECT_LT(least, 0.5);
  EXPECT_EQ(most, 1);
  EXPECT_EQ(first_loss({.mixed = 0, .out_of_view = 1, .rerender = 0}), unseen);
}

TEST(LightTraining, WhatHasNoWeightIsNotBuilt) {
  Wall wall;
  wall.options.weights = {.mixed = 0, .out_of_view = 1, .rerender = 0};
  Graph graph;
  const LightTraining training = light_training(graph, small_sizes(), wall.options);
  EXPECT_EQ(training.losses.size(), 2u);
  for (const Node& node : graph.nodes()) EXPECT_NE(node.op->name(), "sample_brdf");
  wall.options.weights = {0, 0, 0};
  Graph empty;
  EXPECT_THROW(light_training(empty, small_sizes(), wall.options), Error);
}

}  // namespace
}  // namespace clerestory
