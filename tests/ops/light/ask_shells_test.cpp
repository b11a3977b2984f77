// Painted spheres in one kernel, beside the ops that it puts together.
#include "host/ops/light/ask_shells.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "checks/light/ask_shells_reference.hpp"
#include "checks/light/listed_rays.hpp"
#include "checks/light/shell_reference.hpp"
#include "checks/op_case.hpp"
#include "host/ops/light/composite.hpp"
#include "host/ops/light/shells.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/ops/light/net.hpp"

namespace clerestory {
namespace {

using namespace ask_shells_reference;

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
