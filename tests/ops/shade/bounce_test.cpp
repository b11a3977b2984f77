// Rays that go on from inserted objects, in chunks.
#include "host/ops/shade/bounce.hpp"

#include <gtest/gtest.h>

#include "checks/op_case.hpp"
#include "checks/shade/hash_reference.hpp"
#include "host/graph/map_chunks.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "tests/ops/test_device.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

constexpr int kRows = 12, kSamples = 16, kObjects = 3, kNumber = 2;

// Samples of every chunk have numbers of their own: however 32 are cut, they are the same 32.
TEST(Bounce, ChunksDoNotMatter) {
  constexpr int samples = 32;
  const auto mean = [&](int chunk_pixels, int chunk_samples) {
    Graph graph;
    const Value ambient = graph.input("ambient", {1, 3, 1, 1});
    const auto body = [&](Graph& g, std::span<const Value> in) -> std::vector<ChunkOutput> {
      const Shape rays{1, 3, chunk_pixels, chunk_samples}, one{1, 1, chunk_pixels, chunk_samples};
      const Value along = g.fill(rays, 1), all = g.constant(random_ints(one, 5, 0, 1));
      const Bounce b = bounce(along, g.fill(rays, -1), all, g.fill({1, 5, 1, 1}, 0.5), {}, kNumber);
      return {{accumulate_samples(add(b.direction, expand(in[0], rays)), along, g.fill(one, 1), {}, {}, samples).mean}};
    };
    const Value result =
        map_chunks(graph, {1, 2, 3, samples, chunk_pixels, chunk_samples}, std::vector{ambient}, body)[0];
    return evaluate(graph, std::vector{result}, test_device(Precision::Double),
                    {{"ambient", Tensor(Shape{1, 3, 1, 1})}}, {.precision = Precision::Double})[0];
  };
  const Tensor whole = mean(6, 32), cut = mean(4, 16);
  for (std::size_t i = 0; i < whole.real.size(); ++i)
    EXPECT_NEAR(whole.real[i], cut.real[i], 32 * 2 * kDoubleRounding);  // a mean of 32 below 2
  EXPECT_NE(whole.real[0], whole.real[1]) << "pixels have numbers of their own, too";
}

TEST(Bounce, RefusesWhatDoesNotFit) {
  Graph g;
  const Value rays = g.input("rays", {1, 3, 4, 16}), object = g.input("object", {1, 1, 4, 16}, Type::Int);
  const Value real = g.input("real", {1, 1, 4, 16}), five = g.input("five", {2, 5, 1, 1});
  EXPECT_THROW(bounce(rays, rays, real, five, {}, 1), Error);
  EXPECT_THROW(bounce(real, rays, object, five, {}, 1), Error);
  EXPECT_THROW(bounce(rays, rays, object, five, {real, real}, 1), Error);
  EXPECT_THROW(bounce(rays, rays, object, g.input("four", {2, 4, 1, 1}), {}, 1), Error);
}

}  // namespace
}  // namespace clerestory
