#include "host/ops/nn/batch_norm.hpp"

#include <gtest/gtest.h>

#include "host/ops/tensor/elementwise.hpp"

namespace clerestory {
namespace {

constexpr Shape kShape{3, 4, 5, 7}, kChannel{1, 4, 1, 1};

}  // namespace

TEST(BatchNorm, GradientsOfOthersAreAddedInside) {
  Graph g;
  const Value x = g.input("x", kShape), gamma = g.input("gamma", kChannel), beta = g.input("beta", kChannel);
  const Value y = normalise_channels(x, channel_moments(x), gamma, beta, true), other = scale(x, 3);
  gradient(std::vector{y, other}, std::vector{g.input("dy", kShape), g.input("dother", kShape)}, std::vector{x});
  for (const Node& node : g.nodes()) EXPECT_NE(node.op->name(), "accumulate");
}

}  // namespace clerestory
