// Out-of-view light as painted spheres: its forms, its independence of the batch, its gradient.
#include "nets/light_shells.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/math/camera.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/nn/map_loss.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "nets/out_of_view.hpp"
#include "tests/nets/golden.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

constexpr int kHeight = 32, kWidth = 48;
constexpr Shape kRays{1, 3, 4, 16};

OutOfViewSize small_size() {
  OutOfViewSize size;
  size.form = OutOfViewForm::Shells, size.log_input = true, size.sees_maps = true;
  size.trunk = {.blocks = {1, 1, 0, 0}, .channels = {8, 16, 0, 0}, .stages = 2};
  size.shells = {.count = 3, .rows = 16, .columns = 32, .channels = {16, 32}, .code = 8};
  return size;
}

LightInputs pictures(Graph& graph, int n) {
  const auto map = [&](const char* name, int channels) { return graph.input(name, {n, channels, kHeight, kWidth}); };
  return {map("image", 3),
          map("depth", 1),
          {map("albedo", 3), map("normal", 3), map("material", 3)},
          graph.input("camera", {n, 4, 1, 1}),
          graph.input("range", {n, 3, 1, 1})};
}

/// Item `first` onwards of two pictures.
std::map<std::string, Tensor> feeds(int n, int first) {
  std::map<std::string, Tensor> f;
  for (const auto& [name, channels] :
       {std::pair{"image", 3}, {"depth", 1}, {"albedo", 3}, {"normal", 3}, {"material", 3}}) {
    const Tensor both = formula(name, {2, channels, kHeight, kWidth});
    Tensor t(Shape{n, channels, kHeight, kWidth});
    const std::size_t item = static_cast<std::size_t>(channels) * kHeight * kWidth;
    for (std::size_t i = 0; i < t.real.size(); ++i)
      t.real[i] = 1 + both.real[static_cast<std::size_t>(first) * item + i];
    f[name] = std::move(t);
  }
  std::vector<Camera> cameras;
  for (int i = 0; i < n; ++i) cameras.push_back(Camera::from_fov(kWidth, kHeight, first + i == 0 ? 60 : 90));
  f["camera"] = camera_tensor(cameras);
  f["range"] = Tensor(Shape{n, 3, 1, 1}, 2.0);
  return f;
}

struct Rays {
  Value points, directions;
  explicit Rays(Graph& graph) {
    Tensor p = formula("points", kRays), d = formula("directions", kRays);
    for (int row = 0; row < kRays.h; ++row)
      for (int s = 0; s < kRays.w; ++s) {
        double squares = 0;
        for (int c = 0; c < 3; ++c) squares += std::pow(d.at(0, c, row, s), 2);
        for (int c = 0; c < 3; ++c) d.at(0, c, row, s) /= std::sqrt(squares);
      }
    points = graph.constant(p), directions = graph.constant(d);
  }
};

/// Radiance of picture `which` of a batch of n that begins at `first`.
Tensor answered(int n, int first, int which) {
  Graph graph;
  const LightInputs lit = pictures(graph, n);
  const OutOfViewSize size = small_size();
  const std::vector<LightField> fields = light_fields({graph, false, "global"}, lit, size);
  const Rays rays(graph);
  const Value range = graph.fill({1, 3, 1, 1}, 2);
  const Value light =
      out_of_view_light(fields[static_cast<std::size_t>(which)], rays.points, rays.directions, range, size);
  const Device device = device_for(Precision::Double);
  const auto states = std::make_shared<States>(device, Precision::Double);
  states->initialise(graph, 5);
  return evaluate(graph, {light}, device, feeds(n, first), {.precision = Precision::Double}, 0, states)[0];
}

TEST(LightShells, RadiiAreGeometric) {
  const std::vector<double> radii = shell_radii({.count = 4, .first = 0.25, .last = 2});
  ASSERT_EQ(radii.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_DOUBLE_EQ(radii[i], 0.25 * std::pow(2, i));
  EXPECT_EQ(shell_radii({.count = 1, .last = 3}), std::vector{3.0});
}

TEST(LightShells, APictureDoesNotDependOnItsBatch) {
  const Tensor alone = answered(1, 1, 0), second = answered(2, 0, 1);
  double most = 0;
  for (std::size_t i = 0; i < alone.real.size(); ++i) {
    // Sums of a thousand terms, in another order.
    EXPECT_NEAR(alone.real[i], second.real[i], 1000 * kDoubleRounding * (1 + std::abs(alone.real[i])));
    most = std::max(most, alone.real[i]);
    EXPECT_GE(alone.real[i], 0);
  }
  EXPECT_GT(most, 0);
  EXPECT_NE(answered(2, 0, 0).real, second.real);
}

TEST(LightShells, OutermostIsOpaqueAndInnerOnesCoverIt) {
  Graph graph;
  const ShellsSize size{.count = 2, .first = 1, .last = 3, .rows = 8, .columns = 16};
  Tensor shells(Shape{2, 4, size.rows, size.columns});
  for (int y = 0; y < size.rows; ++y)
    for (int x = 0; x < size.columns; ++x) {
      shells.at(0, 0, y, x) = 5, shells.at(0, 3, y, x) = std::log(2.0);  // half of what is behind is covered
      shells.at(1, 0, y, x) = 2, shells.at(1, 3, y, x) = 1e3;
    }
  Tensor points(Shape{1, 3, 1, 16}), directions(Shape{1, 3, 1, 16}, 1);
  points.at(0, 2, 0, 1) = -2, directions.at(0, 2, 0, 1) = -10;  // starts beyond the first and goes away from it
  const Value light = shells_light(graph.constant(shells), graph.constant(points), graph.constant(directions),
                                   graph.fill({1, 3, 1, 1}, 1), size);
  const Tensor found = evaluate(graph, {light}, device_for(Precision::Double), {}, {.precision = Precision::Double})[0];
  const double rounding = 16 * 5 * kDoubleRounding;  // directions, places among texels, transmittances; values to 5
  EXPECT_NEAR(found.at(0, 0, 0, 0), 0.5 * 5 + 0.5 * 2, rounding);
  EXPECT_NEAR(found.at(0, 0, 0, 1), 2, rounding);
}

TEST(LightShells, GradientIsThatOfDifferences) {
  Graph graph;
  const OutOfViewSize size = small_size();
  const std::vector<LightField> fields = light_fields({graph, false, "global"}, pictures(graph, 1), size);
  const Rays rays(graph);
  const Value range = graph.fill({1, 3, 1, 1}, 2);
  const Value loss = mean(out_of_view_light(fields[0], rays.points, rays.directions, range, size));
  const Device device = device_for(Precision::Double);
  for (const char* name : {"global.shells.paint.bias", "global.shells.choose.bias", "global.shells.across.out.bias"}) {
    Value state;
    for (const Value& v : graph.parameters())
      if (static_cast<const StateOp&>(*v.node->op).state_name == name) state = v;
    ASSERT_TRUE(state) << name;
    const Value slope = gradient(loss, std::vector{state})[0];
    const auto states = std::make_shared<States>(device, Precision::Double);
    states->initialise(graph, 5);
    Executor executor(compile(graph, {loss, slope}, device, {.precision = Precision::Double}), states);
    for (const auto& [input, tensor] : feeds(1, 0)) executor.feed(input, tensor);
    executor.run();
    const Tensor found = executor.fetch(slope), start = states->get(name);
    for (std::size_t i = 0; i < std::min<std::size_t>(8, found.real.size()); ++i) {
      constexpr double step = 1e-5;
      double ends[2];
      for (const int side : {0, 1}) {
        Tensor moved = start;
        moved.real[i] += side ? step : -step;
        states->set(name, moved);
        executor.run();
        ends[side] = executor.fetch(loss).real[0];
      }
      states->set(name, start);
      // A ReLU whose corner lies within the step costs a part of the slope; none does at this seed. Else a difference
      // errs by step^2 of the third slope and by a few thousand roundings of the loss over the step.
      EXPECT_NEAR(found.real[i], (ends[1] - ends[0]) / (2 * step), 1e-6 * (1 + std::abs(found.real[i])))
          << name << " " << i;
    }
  }
}

}  // namespace
}  // namespace clerestory
