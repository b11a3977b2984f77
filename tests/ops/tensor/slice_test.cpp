// Slices of channels, as views and copied.
#include "host/ops/tensor/slice.hpp"

#include <gtest/gtest.h>

#include "checks/op_case.hpp"
#include "host/graph/plan.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {

/// The gradient of x {2, 6, 2, 3} from slices of two channels that begin where `firsts` say, each with a gradient of
/// its own; and the op that makes it.
void expect_gradient_of_slices(const std::vector<int>& firsts, const std::string& op) {
  Graph g;
  const Value x = g.input("x", {2, 6, 2, 3});
  std::vector<Value> slices, seeds;
  std::map<std::string, Tensor> feeds{{"x", random_tensor(x.shape(), 1)}};
  Tensor expected(x.shape());
  for (const int first : firsts) {
    const std::string name = "seed" + std::to_string(slices.size());
    Tensor seed = random_tensor({2, 2, 2, 3}, slices.size() + 2);
    for (double& v : seed.real) v = static_cast<float>(v);
    slices.push_back(slice(x, first, 2)), seeds.push_back(g.input(name, seed.shape));
    feeds[name] = seed;
    for (int n = 0; n < 2; ++n)
      for (int c = 0; c < 2; ++c)
        for (int i = 0; i < 6; ++i) expected.at(n, first + c, i / 3, i % 3) += seed.at(n, c, i / 3, i % 3);
  }
  const Value dx = gradient(slices, seeds, std::vector{x})[0];
  EXPECT_EQ(dx.node->op->name(), op);
  const Tensor found = evaluate(g, {dx}, test_device(), feeds)[0];
  for (std::size_t i = 0; i < expected.real.size(); ++i)
    EXPECT_EQ(found.real[i], static_cast<float>(expected.real[i])) << i;
}

TEST(Slice, GradientsOfSlicesStandSideBySide) {
  expect_gradient_of_slices({2}, "slice_adjoint");
  expect_gradient_of_slices({4, 0, 2}, "concat");
  expect_gradient_of_slices({3, 0}, "concat");      // one channel between them, one behind
  expect_gradient_of_slices({0, 1}, "accumulate");  // they overlap
}

}  // namespace clerestory
