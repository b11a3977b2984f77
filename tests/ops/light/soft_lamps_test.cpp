#include "host/ops/light/soft_lamps.hpp"

#include <gtest/gtest.h>

#include "checks/light/soft_lamps_rays.hpp"
#include "checks/op_case.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {

using namespace soft_lamps_rays;

// The unknowns of a chunk that does not fill its tile: what lies beyond its samples weighs nothing.
TEST(WeighLamps, SamplesBeyondTheChunkAreNotThere) {
  Tensors in = rays(3, 32, 5, true, 0.3, 1.5);
  in["weight"] = random_tensor({1, 3, 3, 32}, 8, 0, 1);
  Tensors less = in;
  for (int c = 0; c < 3; ++c)
    for (int p = 0; p < 3; ++p)
      for (int s = 19; s < 32; ++s) less["weight"].at(0, c, p, s) = 0;
  const auto run = [](const Tensors& inputs, const Chunk& chunk) {
    Graph g;
    Values v;
    for (const auto& [name, tensor] : inputs) v[name] = g.constant(tensor);
    const Value y = weigh_lamps(v["weight"], rays_of(v), v["places"]);
    Executor executor(compile(g, {y}, test_device()));
    executor.run(0, chunk);
    return executor.fetch(y).real;
  };
  EXPECT_EQ(run(in, {0, 3, 0, 19}), run(less, {0, 3, 0, 32}));
  EXPECT_NE(run(in, {0, 3, 0, 32}), run(less, {0, 3, 0, 32}));
}

TEST(SoftLamps, RefuseLobesOfOtherRays) {
  Graph g;
  const Value rgb = g.input("rgb", {1, 3, 4, 16}), one = g.input("one", {1, 1, 4, 16}),
              places = g.input("places", {1, 4, 1, 2}), colors = g.input("colors", {1, 3, 1, 2});
  const Value fewer_rgb = g.input("fewer_rgb", {1, 3, 2, 16}), fewer = g.input("fewer", {1, 1, 2, 16});
  EXPECT_NO_THROW(add_lamps(rgb, {rgb, rgb, one, {rgb, one}}, places, colors));
  EXPECT_THROW(add_lamps(rgb, {rgb, rgb, one, {fewer_rgb, one}}, places, colors), Error);
  EXPECT_THROW(add_lamps(rgb, {rgb, rgb, one, {rgb, fewer}}, places, colors), Error);
}

}  // namespace clerestory
