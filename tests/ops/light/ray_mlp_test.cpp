// The in-view light's MLP along rays, beside the ops that it puts together and their adjoints.
#include "host/ops/light/ray_mlp.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "checks/light/ask_mlp_reference.hpp"
#include "host/error.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/ops/light/net.hpp"
#include "tests/worst.hpp"

namespace clerestory {
namespace {

using namespace ask_mlp_reference;

Value composed(const Mlp& m, const Values& v) {
  Value x;
  for (int layer = 0; layer < m.layers; ++layer) {
    Value y = conv(layer == 0 ? v.at("encoded") : x, v.at(layer == 0 ? direction_name(0) : hidden_name(layer)),
                   v.at(bias_name(layer)));
    if (layer > 0 && m.reads(layer)) y = add(y, conv(v.at("encoded"), v.at(direction_name(layer)), {}));
    if (m.reads(layer)) y = add(y, slice(v.at("input"), layer > 0 ? m.width : 0, m.width));
    x = relu(y);
  }
  return conv(x, v.at("out"), v.at("out_bias"));
}

/// f, then the gradients of all inputs in the order of their names.
std::vector<Value> both_ways(Graph& g, Value f, const Values& v) {
  std::vector<Value> wanted;
  for (const auto& [name, value] : v) wanted.push_back(value);
  std::vector<Value> all = gradient(std::vector{f}, std::vector{g.constant(random_tensor(f.shape(), 3))}, wanted);
  all.insert(all.begin(), f);
  return all;
}

TEST(RayMlp, IsConvAddAndReluBothWays) {
  for (const Mlp& m : {Mlp{.width = 128, .layers = 4, .waves = 160}, Mlp{.width = 512, .layers = 3, .again = 1}}) {
    const Tensors inputs = ray_inputs(m, 9, 37);
    Net net(inputs);
    const Value fused = ray_mlp(net_of(m, net.values), net.values.at("input"), net.values.at("encoded"));
    std::vector<Value> both = both_ways(net.graph, fused, net.values);
    const std::size_t half = both.size();
    const std::vector<Value> other = both_ways(net.graph, composed(m, net.values), net.values);
    both.insert(both.end(), other.begin(), other.end());
    const std::vector<Tensor> got = net.run(both, inputs, Precision::Double);
    for (std::size_t i = 0; i < half; ++i) {
      double worst = 0, largest = 0;
      for (std::size_t k = 0; k < got[i].real.size(); ++k) {
        worst = worse(worst, std::abs(got[i].real[k] - got[half + i].real[k]));
        largest = std::max(largest, std::abs(got[half + i].real[k]));
      }
      EXPECT_GT(largest, 0.1) << i;
      // Sums of up to 512 numbers, four layers of them, and of 333 rays: their roundings add up to a thousand epsilons
      // at most, and are independent.
      EXPECT_LE(worst, 1000 * 0x1p-52 * largest) << i;
    }
  }
}

TEST(RayMlp, ArgumentsAreChecked) {
  const Mlp m;
  Net net(ray_inputs(m, 2, 16));
  const auto build = [](const Mlp& mlp, const Values& v) {
    return ray_mlp(net_of(mlp, v), v.at("input"), v.at("encoded"));
  };
  const auto change = [&](const char* name, const Shape& shape) {
    Values changed = net.values;
    changed[name] = net.graph.fill(shape, 0);
    return changed;
  };
  EXPECT_NO_THROW(build(m, net.values));
  EXPECT_THROW(build(m, change("input", {1, 32, 3, 16})), Error);
  EXPECT_THROW(build(m, change("input", {1, 64, 2, 16})), Error);
  EXPECT_THROW(build(m, change("encoded", {1, 15, 2, 16})), Error);
  EXPECT_THROW(build(m, change("encoded", {2, 16, 2, 16})), Error);
  EXPECT_THROW(build(m, change("hidden1", {32, 31, 1, 1})), Error);
  EXPECT_THROW(build(m, change("along0", {520, 16, 1, 1})), Error);
  EXPECT_THROW(build(m, change("out", {4, 32, 1, 1})), Error);
  EXPECT_THROW(build(m, change("bias1", {1, 16, 1, 1})), Error);
  Mlp reading = m;  // a layer that there is not
  reading.again = 3;
  EXPECT_THROW(build(reading, net.values), Error);
}

}  // namespace
}  // namespace clerestory
