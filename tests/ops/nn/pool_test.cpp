#include "host/ops/nn/pool.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "checks/op_case.hpp"
#include "tests/ops/test_device.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

// Behind a ReLU most maxima are ties of zeros: the gradient goes to the first in reading order, and only there.
TEST(Pool, AmongEqualNumbersTheFirstIsTheMaximum) {
  constexpr Shape shape{1, 1, 7, 9};
  Tensor x(shape);
  for (std::size_t i = 0; i < x.real.size(); ++i) x.real[i] = static_cast<double>(i * i % 3);  // 0 and 1
  for (const MaxPoolSpec& spec : {MaxPoolSpec{}, MaxPoolSpec{.window = 2, .pad = 0}}) {
    Graph g;
    const Value in = g.input("x", shape), y = max_pool(in, spec);
    const Tensor dy = random_tensor(y.shape(), 3, 1, 2);
    const Value dx = gradient(std::vector{y}, std::vector{g.constant(dy)}, std::vector{in})[0];
    Tensor want(shape);
    for (int j = 0; j < y.shape().h; ++j)
      for (int i = 0; i < y.shape().w; ++i) {
        int row = -1, column = -1;
        for (int v = std::max(2 * j - spec.pad, 0); v < std::min(2 * j - spec.pad + spec.window, shape.h); ++v)
          for (int u = std::max(2 * i - spec.pad, 0); u < std::min(2 * i - spec.pad + spec.window, shape.w); ++u)
            if (row < 0 || x.at(0, 0, v, u) > x.at(0, 0, row, column)) row = v, column = u;
        want.at(0, 0, row, column) += dy.at(0, 0, j, i);
      }
    const Tensor got =
        evaluate(g, {dx}, test_device(Precision::Double), {{"x", x}}, {.precision = Precision::Double})[0];
    // Four windows at most meet in a pixel: three sums below 8.
    for (std::size_t i = 0; i < want.real.size(); ++i)
      EXPECT_NEAR(got.real[i], want.real[i], 3 * 8 * kDoubleRounding) << i;
  }
}

TEST(Pool, NoGradientIsLostWhereAllIsMinusInfinity) {
  constexpr Shape shape{1, 1, 7, 9};
  for (const MaxPoolSpec& spec : {MaxPoolSpec{}, MaxPoolSpec{.window = 2, .pad = 0}}) {
    Graph g;
    const Value in = g.input("x", shape), y = max_pool(in, spec);
    const Value dx = gradient(std::vector{y}, std::vector{g.fill(y.shape(), 1)}, std::vector{in})[0];
    const Tensor got = evaluate(g, {dx}, test_device(), {{"x", Tensor(shape, -INFINITY)}})[0];
    double sum = 0;
    for (const double d : got.real) sum += d;
    EXPECT_EQ(sum, y.shape().plane());
  }
}

}  // namespace
}  // namespace clerestory
