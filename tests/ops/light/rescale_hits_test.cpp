// Hit pixels as cells of other grids.
#include "host/ops/light/rescale_hits.hpp"

#include <gtest/gtest.h>

#include "checks/op_case.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

TEST(RescaleHits, OfTheSameSizeIsNothing) {
  Graph g;
  const Value hit = g.input("hit", {1, 1, 2, 16}, Type::Int);
  EXPECT_EQ(rescale_hits(hit, {1, 3, 4, 5}, {2, 7, 4, 5}), hit);
}

TEST(RescaleHits, SamplesBeyondTheChunkAreMisses) {
  const Tensor hits = random_ints({1, 1, 3, 32}, 2, 0, 48);
  Graph g;
  const Value y = rescale_hits(g.constant(hits), {1, 1, 6, 8}, {1, 1, 3, 4});
  Executor executor(compile(g, {y}, test_device()));
  executor.run(0, {0, 3, 0, 19});
  const std::vector<int> found = executor.fetch(y).integer;
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i] < 0, i % 32 >= 19) << i;
}

}  // namespace
}  // namespace clerestory
