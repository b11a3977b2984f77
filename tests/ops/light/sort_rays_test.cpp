// The order of rays by the pixels that they hit, in a chunk.
#include "host/ops/light/sort_rays.hpp"

#include <gtest/gtest.h>

#include "checks/light/sort_rays_reference.hpp"
#include "checks/op_case.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

using namespace sort_rays_reference;

// A tile that the chunk does not fill: rays beyond it are misses, whatever they hit.
TEST(SortRays, RaysBeyondTheChunkComeLast) {
  constexpr Shape map{1, 1, 8, 8};
  const Tensor hit = random_ints({1, 1, 6, 32}, 4, 0, 64);
  Tensor inside = hit;
  for (int p = 0; p < 6; ++p)
    for (int s = 0; s < 32; ++s)
      if (p >= 4 || s >= 19) inside.integer[static_cast<std::size_t>(p * 32 + s)] = -1;
  Graph g;
  const SortedRays sorted = sort_rays(g.input("hit", hit.shape, Type::Int), map);
  Executor executor(compile(g, {sorted.order, sorted.starts}, test_device()));
  executor.feed("hit", hit);
  executor.run(0, {10, 4, 64, 19});
  const std::vector<Tensor> want = sorted_reference(inside, map);
  EXPECT_EQ(executor.fetch(sorted.order).integer, want[0].integer);
  EXPECT_EQ(executor.fetch(sorted.starts).integer, want[1].integer);
}

}  // namespace
}  // namespace clerestory
