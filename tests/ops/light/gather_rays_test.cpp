// Features gathered at hits and summed back, in chunks and in long sums.
#include "host/ops/light/gather_rays.hpp"

#include <gtest/gtest.h>

#include "checks/op_case.hpp"
#include "host/graph/map_chunks.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

constexpr Shape kMap{2, 5, 4, 6};

// In chunks of pixels and of samples, the rest of each tile beyond the chunk: every ray sees pixel 3 of its own
// picture, which thus gathers the gradients of the whole picture.
TEST(GatherRays, GradientsOfChunksAddUp) {
  constexpr Shape map{2, 3, 4, 6};
  constexpr int samples = 20, chunk_pixels = 7, chunk_samples = 16;
  const Tensor cotangent = random_tensor(map, 2);
  Graph graph;
  const Value input = graph.input("map", map);
  const auto body = [&](Graph& g, std::span<const Value> in) -> std::vector<ChunkOutput> {
    const Value hits = g.constant(random_ints({1, 1, chunk_pixels, chunk_samples}, 5, 3, 4));
    const Value one = g.fill({1, 3, chunk_pixels, chunk_samples}, 1),
                pdf = g.fill({1, 1, chunk_pixels, chunk_samples}, 1);
    return {{accumulate_samples(one, gather_rays(in[0], hits), pdf, {}, {}, samples).mean}};
  };
  const ChunkDomain domain{map.n, map.h, map.w, samples, chunk_pixels, chunk_samples};
  const Value mean = map_chunks(graph, domain, std::vector{input}, body)[0];
  const Value g = gradient(std::vector{mean}, std::vector{graph.constant(cotangent)}, std::vector{input})[0];
  const Tensor found = evaluate(graph, {g}, test_device(Precision::Double), {{"map", random_tensor(map, 1)}},
                                {.precision = Precision::Double})[0];
  for (int n = 0; n < map.n; ++n)
    for (int c = 0; c < map.c; ++c) {
      double sum = 0;
      for (int y = 0; y < map.h; ++y)
        for (int x = 0; x < map.w; ++x) sum += cotangent.at(n, c, y, x);
      for (int y = 0; y < map.h; ++y)
        for (int x = 0; x < map.w; ++x)  // 24 sums of 20 shares
          EXPECT_NEAR(found.at(n, c, y, x), y == 0 && x == 3 ? sum : 0, 1e-13);
    }
}

// The pixels of a chunk count from its first: here 20 of the first picture's 24 come before, so that its rows from the
// fifth on are the second picture's. Beyond the chunk there is nothing.
TEST(GatherRays, AChunkReadsItsOwnPictures) {
  const Tensor map = random_tensor(kMap, 1), hit = random_ints({1, 1, 10, 32}, 2, 0, 24);
  Graph g;
  const Value y = gather_rays(g.constant(map), g.constant(hit));
  Executor executor(compile(g, {y}, test_device(Precision::Double), {.precision = Precision::Double}));
  executor.run(0, {20, 10, 0, 19});
  const Tensor got = executor.fetch(y);
  for (int c = 0; c < kMap.c; ++c)
    for (int p = 0; p < 10; ++p)
      for (int s = 0; s < 32; ++s) {
        const int pixel = hit.integer[static_cast<std::size_t>(p * 32 + s)];
        const double want = s < 19 ? map.at(p < 4 ? 0 : 1, c, pixel / kMap.w, pixel % kMap.w) : 0;
        ASSERT_EQ(got.at(0, c, p, s), want) << c << " " << p << " " << s;
      }
}

// A lamp's pixel that every ray of a chunk hits: 131,072 numbers that float does not hold exactly. Summed one by one
// they would lose four digits.
TEST(GatherRays, ALongSumKeepsItsDigits) {
  constexpr Shape map{1, 1, 64, 64}, rays{1, 1, 4096, 32};
  const Tensor value = random_tensor(rays, 6, 0, 0.1);
  double sum = 0;
  for (const double v : value.real) sum += static_cast<float>(v);
  Graph g;
  const Value total = scatter_rays(g.input("value", rays), g.constant(random_ints(rays, 7, 5, 6)), map);
  const Tensor got = evaluate(g, {total}, test_device(), {{"value", value}})[0];
  // Kahan's bound: two epsilons of the sum of sizes, whatever the count; and the result is rounded.
  EXPECT_NEAR(got.real[5], sum, 3 * 0x1p-23 * sum);
}

}  // namespace
}  // namespace clerestory
