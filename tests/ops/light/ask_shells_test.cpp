// Painted spheres in one kernel: against their definition and against the ops that it puts together.
#include "host/ops/light/ask_shells.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/ops/light/composite.hpp"
#include "host/ops/light/shells.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/ops/light/listed_rays.hpp"
#include "tests/ops/light/shell_reference.hpp"

namespace clerestory {
namespace {

/// `reach`: how far rays start from the camera, in scales; density from 0 to `dense`, the outermost opaque.
Tensors shell_inputs(int rows, int samples, double reach, double dense, const Shape& map, bool point_per_row = false) {
  Tensors t{{"shells", random_tensor({3, 4, map.h, map.w}, 1, 0, 2)},
            {"points", random_tensor({1, 3, rows, point_per_row ? 1 : samples}, 2, -2 * reach, 2 * reach)},
            {"direction", random_tensor({1, 3, rows, samples}, 3)},
            {"range", Tensor({1, 3, 1, 1}, std::vector<double>{2, 1, 2})}};
  for (int k = 0; k < 3; ++k)
    for (int y = 0; y < map.h; ++y)
      for (int x = 0; x < map.w; ++x) {
        double& density = t["shells"].at(k, 3, y, x);
        density = k == 2 ? 1000 : 0.5 * dense * density;
      }
  return t;
}

/// `list` empty: all rays.
Tensor plain_answer(const Tensors& t, const std::vector<int>& list) {
  const std::vector<Tensor> seen = looked_up_shells(t);
  const Shape& rays = t.at("direction").shape;
  Tensor radiance(Shape{1, 3, rays.h, rays.w});
  for (int ray = 0; ray < rays.plane(); ++ray) {
    if (!list.empty() && std::find(list.begin(), list.end(), ray) == list.end()) continue;
    const int p = ray / rays.w, s = ray % rays.w;
    double through = 1;
    for (int k = 0; k < seen[0].shape.n; ++k) {
      const double passes = std::exp(-seen[0].at(k, 3, p, s));
      for (int c = 0; c < 3; ++c) radiance.at(0, c, p, s) += through * (1 - passes) * seen[0].at(k, c, p, s);
      through *= passes;
    }
  }
  return radiance;
}

Value ask(const Values& v, const RayList& list) {
  return ask_shells(v.at("shells"), v.at("points"), v.at("direction"), v.at("range"), list, kShellRadii);
}

/// A place on the map is off by a few units in the last place of the start's distance, times the columns: so is a
/// colour, and the light by as much for each sphere's colour and density.
double roundings_of(double reach, const Shape& map) { return 6 * 64.0 * map.w * (1 + reach); }

OpCase ask_case(const std::string& label, double reach, const Shape& map, Tensors inputs,
                const std::vector<int>& list = {}) {
  OpCase c{.stem = "ask_shells", .label = label, .kernels = {"pack_shells", "ask_shells"}, .inputs = std::move(inputs)};
  const Shape rays = c.inputs.at("direction").shape;
  c.build = [=](Graph& g, const Values& v) {
    return std::vector{ask(v, list.empty() ? RayList{} : list_of(g, list, rays))};
  };
  c.reference = [=](const Tensors& t) { return std::vector{plain_answer(t, list)}; };
  c.roundings = roundings_of(reach, map), c.magnitude = 2;
  c.no_gradient = "for inference: throws";
  return c;
}

OP_CASES(ask_shells) {
  const Shape fine{1, 1, 8, 16}, odd{1, 1, 5, 12}, least{1, 1, 2, 2};
  return {ask_case("inside", 0.2, fine, shell_inputs(6, 32, 0.2, 1, fine)),
          ask_case("around", 1.2, odd, shell_inputs(6, 32, 1.2, 1, odd)),
          ask_case("outside", 5, least, shell_inputs(4, 16, 5, 1, least)),
          ask_case("point_per_row", 0.2, fine, shell_inputs(5, 16, 0.2, 1, fine, true)),
          ask_case("listed", 0.2, fine, shell_inputs(7, 16, 0.2, 1, fine), every(3, 112)),
          ask_case("one_ray", 0.2, fine, shell_inputs(2, 16, 0.2, 1, fine), {17}),
          ask_case("clear", 0.2, fine, shell_inputs(2, 16, 0.2, 0, fine)),
          ask_case("thin", 0.2, fine, shell_inputs(2, 16, 0.2, 1e-7, fine)),
          ask_case("solid", 0.2, fine, shell_inputs(2, 16, 0.2, 1e6, fine))};
}

// Straight backwards, where the panorama's edges meet, and both poles, among other rays.
TEST(AskShells, IsLookUpAndComposite) {
  const Shape map{1, 1, 8, 16};
  Tensors inputs = shell_inputs(5, 48, 0.7, 1, map);
  const double straight[3][3] = {{0, 0, 1}, {0, 2, 0}, {0, -1, 0}};
  for (int s = 0; s < 3; ++s)
    for (int c = 0; c < 3; ++c)
      inputs["direction"].at(0, c, 0, s) = straight[s][c], inputs["points"].at(0, c, 0, s) = 0;
  Net net(inputs);
  const ShellSamples seen = look_up_shells(net.values.at("shells"), net.values.at("points"), net.values.at("direction"),
                                           net.values.at("range"), kShellRadii);
  const Value composed = composite(slice(seen.value, 3, 1), slice(seen.value, 0, 3), seen.met).radiance;
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    const std::vector<Tensor> got = net.run({ask(net.values, {}), composed}, inputs, precision);
    const double epsilon = precision == Precision::Single ? 0x1p-23 : 0x1p-52;
    for (std::size_t i = 0; i < got[0].real.size(); ++i)
      EXPECT_NEAR(got[0].real[i], got[1].real[i], 2 * roundings_of(0.7, map) * epsilon);
  }
}

// Any list and any tile: the same bits for a ray.
TEST(AskShells, ARayIsAskedAlone) {
  const Shape map{1, 1, 8, 16};
  const Tensors inputs = shell_inputs(6, 32, 0.4, 1, map);
  Net net(inputs);
  const Tensor all = net.run({ask(net.values, {})}, inputs, Precision::Single)[0];
  const std::vector<int> list = every(5, 192);
  const Tensor some = net.run({ask(net.values, list_of(net.graph, list, {1, 1, 6, 32}))}, inputs, Precision::Single)[0];
  for (int i = 0; i < 192; ++i)
    for (int c = 0; c < 3; ++c) EXPECT_EQ(some.at(0, c, i / 32, i % 32), i % 5 == 1 ? all.at(0, c, i / 32, i % 32) : 0);

  const Tensors part = tile_of(inputs);
  Net tile(part);
  const Tensor got = tile.run({ask(tile.values, {})}, part, Precision::Single, {2, 4, 16, 16})[0];
  for (int c = 0; c < 3; ++c)
    for (int p = 0; p < 5; ++p)
      for (int s = 0; s < 16; ++s) EXPECT_EQ(got.at(0, c, p, s), p < 4 ? all.at(0, c, p + 2, s + 16) : 0);
}

TEST(AskShells, AnEmptyListGivesZerosAndARayThatIsNoNumberStaysOne) {
  const Shape map{1, 1, 8, 16};
  Tensors inputs = shell_inputs(3, 16, 0.2, 1, map);
  Net net(inputs);
  const Tensor none = net.run({ask(net.values, list_of(net.graph, {}, {1, 1, 3, 16}))}, inputs, Precision::Single)[0];
  EXPECT_EQ(none.real, Tensor(none.shape).real);
  const Tensor before = net.run({ask(net.values, {})}, inputs, Precision::Single)[0];
  inputs["direction"].at(0, 1, 0, 5) = NAN;
  const Tensor after = net.run({ask(net.values, {})}, inputs, Precision::Single)[0];
  for (int s = 0; s < 16; ++s)
    for (int c = 0; c < 3; ++c)
      if (s == 5)
        EXPECT_TRUE(std::isnan(after.at(0, c, 0, s)));
      else
        EXPECT_EQ(after.at(0, c, 0, s), before.at(0, c, 0, s));
}

TEST(AskShells, ArgumentsAreChecked) {
  Net net(shell_inputs(2, 16, 0.2, 1, {1, 1, 8, 16}));
  const auto change = [&](const char* name, const Shape& shape) {
    Values changed = net.values;
    changed[name] = net.graph.fill(shape, 0);
    return changed;
  };
  EXPECT_NO_THROW(ask(net.values, {}));
  EXPECT_THROW(ask(change("shells", {3, 3, 8, 16}), {}), Error);
  EXPECT_THROW(ask(change("shells", {2, 4, 8, 16}), {}), Error);
  EXPECT_THROW(ask(change("points", {1, 3, 3, 16}), {}), Error);
  EXPECT_THROW(ask(change("range", {2, 3, 1, 1}), {}), Error);
  EXPECT_THROW(ask(net.values, list_of(net.graph, {}, {1, 1, 3, 16})), Error);
  const Value y = ask(net.values, {});
  EXPECT_THROW(
      gradient(std::vector{y}, std::vector{net.graph.fill(y.shape(), 1)}, std::vector{net.values.at("shells")}), Error);
}

}  // namespace
}  // namespace clerestory
