// Sums over the samples of a chunk that ends before its tile.
#include "host/ops/shade/sum_samples.hpp"

#include <gtest/gtest.h>

#include "checks/op_case.hpp"
#include "tests/ops/test_device.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

TEST(SumSamples, ColumnsBeyondTheChunkAreZero) {
  const Tensor x = random_tensor({1, 2, 6, 32}, 1);
  Graph g;
  const Value y = sum_samples(g.constant(x));
  Executor executor(compile(g, {y}, test_device(Precision::Double), {.precision = Precision::Double}));
  executor.run(0, {0, 4, 0, 19});
  const Tensor got = executor.fetch(y);
  for (int c = 0; c < 2; ++c)
    for (int p = 0; p < 6; ++p) {
      double sum = 0;
      for (int s = 0; s < 19 && p < 4; ++s) sum += x.at(0, c, p, s);
      EXPECT_NEAR(got.at(0, c, p, 0), sum, 19 * 5 * kDoubleRounding) << c << " " << p;  // sums so far stay below 5
    }
}

}  // namespace
}  // namespace clerestory
