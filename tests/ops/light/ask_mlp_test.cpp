// The in-view light's MLP in one kernel, beside the ops that it puts together.
#include "host/ops/light/ask_mlp.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "checks/light/ask_mlp_reference.hpp"
#include "checks/light/listed_rays.hpp"
#include "checks/op_case.hpp"
#include "host/ops/light/gather_rays.hpp"
#include "host/ops/light/rescale_hits.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/encode.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/ops/light/net.hpp"
#include "tests/worst.hpp"

namespace clerestory {
namespace {

using namespace ask_mlp_reference;

/// The same numbers through memory, as nets/in_view.cpp puts them together; a miss gets those of no lookup.
Value composed(const Mlp& m, const Values& v) {
  const Value hit = v.at("hit");
  const Value looked_up =
      add(gather_rays(v.at("surface"), hit), gather_rays(v.at("features"), rescale_hits(hit, kPicture, kCells)));
  const Value along = encode(v.at("direction"), v.at("frequencies"));
  Value x;
  int read = 0;
  for (int layer = 0; layer < m.layers; ++layer) {
    const Value bias = v.at(bias_name(layer));
    Value y = layer == 0 ? Value{} : conv(x, v.at(hidden_name(layer)), m.reads(layer) ? Value{} : bias);
    if (m.reads(layer)) {
      const Value input =
          add(conv(along, v.at(direction_name(layer)), bias), slice(looked_up, m.width * read++, m.width));
      y = y ? add(y, input) : input;
    }
    x = relu(y);
  }
  return conv(x, v.at("out"), v.at("out_bias"));
}

/// A graph of inputs that is run on chunks of them.
TEST(AskMlp, IsGatherEncodeAndConv) {
  for (const Mlp& m : {Mlp{.width = 128, .layers = 4, .waves = 32}, Mlp{.width = 64, .layers = 9, .again = 5}}) {
    const Tensors inputs = mlp_inputs(m, 5, 48);
    Net net(inputs);
    const std::vector<Value> both{ask(m, net.values, {}), composed(m, net.values)};
    const double roundings = 2 * plain_answer(m, inputs, {}, kWaveAlone).roundings;  // each has its own
    for (const Precision precision : {Precision::Single, Precision::Double}) {
      const std::vector<Tensor> got = net.run(both, inputs, precision);
      const double epsilon = precision == Precision::Single ? 0x1p-23 : 0x1p-52;
      double worst = 0, largest = 0;
      for (int p = 0; p < 5; ++p)
        for (int s = 0; s < 48; ++s)
          for (int c = 0; c < 3; ++c) {
            if (inputs.at("hit").integer[static_cast<std::size_t>(p * 48 + s)] < 0) continue;
            worst = worse(worst, std::abs(got[0].at(0, c, p, s) - got[1].at(0, c, p, s)));
            largest = std::max(largest, std::abs(got[1].at(0, c, p, s)));
          }
      EXPECT_GT(largest, 0.1);
      EXPECT_LE(worst, roundings * epsilon) << "of " << largest;
    }
  }
}

// Any list and any tile: the same bits for a ray.
TEST(AskMlp, ARayIsAskedAlone) {
  const Mlp m{.again = 1};
  const Tensors inputs = mlp_inputs(m, 6, 32);
  Net net(inputs);
  const Tensor all = net.run({ask(m, net.values, {})}, inputs, Precision::Single)[0];
  const Tensor some =
      net.run({ask(m, net.values, list_of(net.graph, every(5, 192), {1, 1, 6, 32}))}, inputs, Precision::Single)[0];
  for (int i = 0; i < 192; ++i)
    for (int c = 0; c < 3; ++c) EXPECT_EQ(some.at(0, c, i / 32, i % 32), i % 5 == 1 ? all.at(0, c, i / 32, i % 32) : 0);

  Tensors part = inputs;  // rows 2 to 5, samples 16 to 31, in a tile with room for a row more
  part["direction"] = random_tensor({1, 3, 5, 16}, 9), part["hit"] = random_ints({1, 1, 5, 16}, 9, 0, 40);
  for (int p = 0; p < 4; ++p)
    for (int s = 0; s < 16; ++s) {
      for (int c = 0; c < 3; ++c) part["direction"].at(0, c, p, s) = inputs.at("direction").at(0, c, p + 2, s + 16);
      part["hit"].integer[static_cast<std::size_t>(p * 16 + s)] =
          inputs.at("hit").integer[static_cast<std::size_t>((p + 2) * 32 + s + 16)];
    }
  Net tile(part);
  const Tensor got = tile.run({ask(m, tile.values, {})}, part, Precision::Single, {2, 4, 16, 16})[0];
  for (int c = 0; c < 3; ++c)
    for (int p = 0; p < 5; ++p)
      for (int s = 0; s < 16; ++s) EXPECT_EQ(got.at(0, c, p, s), p < 4 ? all.at(0, c, p + 2, s + 16) : 0);
}

// Beyond the chunk's samples nobody wrote what is hit: a number that no picture holds is not looked up there.
TEST(AskMlp, ASampleBeyondTheChunkLooksUpNothing) {
  const Mlp m{.again = 1};
  Tensors inputs = mlp_inputs(m, 3, 32);
  Net clean(inputs);
  const Tensor all = clean.run({ask(m, clean.values, {})}, inputs, Precision::Single)[0];
  for (int p = 0; p < 3; ++p)
    for (int s = 16; s < 32; ++s) inputs.at("hit").integer[static_cast<std::size_t>(p * 32 + s)] = 1 << 30;
  Net net(inputs);
  const Tensor got = net.run({ask(m, net.values, {})}, inputs, Precision::Single, {0, 3, 0, 16})[0];
  for (int c = 0; c < 3; ++c)
    for (int p = 0; p < 3; ++p)
      for (int s = 0; s < 32; ++s) EXPECT_EQ(got.at(0, c, p, s), s < 16 ? all.at(0, c, p, s) : 0);
}

TEST(AskMlp, AnEmptyListGivesZeros) {
  const Mlp m;
  const Tensors inputs = mlp_inputs(m, 3, 16);
  Net net(inputs);
  const Tensor f = net.run({ask(m, net.values, list_of(net.graph, {}, {1, 1, 3, 16}))}, inputs, Precision::Single)[0];
  EXPECT_EQ(f.real, Tensor(f.shape).real);
}

TEST(AskMlp, ArgumentsAreChecked) {
  const Mlp m;
  Net net(mlp_inputs(m, 2, 16));
  const auto change = [&](const char* name, const Shape& shape) {
    Values changed = net.values;
    changed[name] = net.graph.fill(shape, 0);
    return changed;
  };
  EXPECT_NO_THROW(ask(m, net.values, {}));
  EXPECT_THROW(ask(m, change("hit", {1, 1, 2, 16}), {}), Error);  // not integers
  EXPECT_THROW(ask(m, change("direction", {1, 3, 3, 16}), {}), Error);
  EXPECT_THROW(ask(m, change("hidden1", {32, 31, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, change("along0", {24, 16, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, change("frequencies", {7, 3, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, change("out", {4, 32, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, change("bias1", {1, 16, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, net.values, list_of(net.graph, {}, {1, 1, 3, 16})), Error);
  Mlp reading = m;  // a layer that there is not
  reading.again = 3;
  EXPECT_THROW(ask(reading, net.values, {}), Error);
  const Value y = ask(m, net.values, {});
  EXPECT_THROW(gradient(std::vector{y}, std::vector{net.graph.fill(y.shape(), 1)}, std::vector{net.values.at("out")}),
               Error);
}

}  // namespace
}  // namespace clerestory
