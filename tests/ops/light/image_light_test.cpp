// Lights without a network: gradients of chunks, long sums, what is refused.
#include "host/ops/light/image_light.hpp"

#include <gtest/gtest.h>

#include "checks/op_case.hpp"
#include "host/graph/map_chunks.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

constexpr int kBatch = 2, kHeight = 3, kWidth = 5, kRows = kBatch * kHeight * kWidth;

// In chunks of pixels and of samples, rest of each tile beyond the chunk, rows of two pictures in one chunk.
TEST(ImageLight, GradientsOfChunksAddUp) {
  constexpr Shape picture{kBatch, 3, kHeight, kWidth};
  constexpr int samples = 20, chunk_pixels = 7, chunk_samples = 16;
  const Tensor cotangent = random_tensor(picture, 2);
  for (const int pixel : {-1, 3}) {  // every ray misses, every ray hits this pixel of its own picture
    Graph graph;
    const Value image = graph.input("image", picture), ambient = graph.input("ambient", {kBatch, 3, 1, 1});
    const auto body = [&](Graph& g, std::span<const Value> in) -> std::vector<ChunkOutput> {
      const Value hits = g.constant(random_ints({1, 1, chunk_pixels, chunk_samples}, 5, pixel, pixel + 1));
      const Value one = g.fill({1, 3, chunk_pixels, chunk_samples}, 1),
                  pdf = g.fill({1, 1, chunk_pixels, chunk_samples}, 1);
      const Value light = add(image_light(in[0], in[1], hits), constant_light(in[1], pdf, in[0]));
      return {{accumulate_samples(one, light, pdf, {}, {}, samples).mean}};
    };
    const ChunkDomain domain{kBatch, kHeight, kWidth, samples, chunk_pixels, chunk_samples};
    const Value mean = map_chunks(graph, domain, std::vector{image, ambient}, body)[0];
    const std::vector<Value> g =
        gradient(std::vector{mean}, std::vector{graph.constant(cotangent)}, std::vector{image, ambient});
    const std::vector<Tensor> found =
        evaluate(graph, g, test_device(Precision::Double),
                 {{"image", random_tensor(picture, 1)}, {"ambient", random_tensor({kBatch, 3, 1, 1}, 3)}},
                 {.precision = Precision::Double});
    for (int n = 0; n < kBatch; ++n)
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x) sum += cotangent.at(n, c, y, x);
        // 15 sums of 20 shares of values below 1
        EXPECT_NEAR(found[1].at(n, c, 0, 0), pixel < 0 ? 2 * sum : sum, 1e-13);
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x)
            EXPECT_NEAR(found[0].at(n, c, y, x), y * kWidth + x == pixel ? sum : 0, 1e-13);
      }
  }
}

// The ambient sees every ray of a picture: a million numbers, rows of 16 one by one and the 65,536 rows with Kahan's
// compensation, so that float keeps its digits.
TEST(ImageLight, ALongSumKeepsItsDigits) {
  constexpr Shape rays{1, 3, 1 << 16, 16};
  Graph g;
  const Value ambient = g.input("ambient", {1, 3, 1, 1}), image = g.input("image", {1, 3, 256, 256});
  const Tensor cotangent = random_tensor(rays, 6, 0, 0.1);
  const Value light = constant_light(ambient, g.constant(Tensor(rays)), image);
  const Value total = gradient(std::vector{light}, std::vector{g.input("cotangent", rays)}, std::vector{ambient})[0];
  const Tensor got = evaluate(g, {total}, test_device(), {{"cotangent", cotangent}})[0];
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (long i = c * rays.plane(); i < (c + 1) * rays.plane(); ++i)
      sum += static_cast<float>(cotangent.real[static_cast<std::size_t>(i)]);
    // 15 roundings of half an epsilon in a row, Kahan's two, and the result's.
    EXPECT_NEAR(got.at(0, c, 0, 0), sum, (7.5 + 2 + 0.5) * 0x1p-23 * sum);
  }
}

TEST(ImageLight, RefusesWhatDoesNotFit) {
  Graph g;
  const Value image = g.input("image", {1, 3, 4, 4}), ambient = g.input("ambient", {1, 3, 1, 1});
  EXPECT_THROW(image_light(image, ambient, g.input("real", {1, 1, 16, 16})), Error);
  const Value hit = g.input("hit", {1, 1, 16, 16}, Type::Int);
  EXPECT_THROW(image_light(image, image, hit), Error);
  EXPECT_THROW(image_light(image, ambient, hit, hit), Error);
  EXPECT_THROW(image_light(image, ambient, hit, g.input("u", {1, 1, 15, 16})), Error);
  EXPECT_THROW(panorama_light(image, ambient, ambient, g.input("rays", {1, 3, 16, 16})), Error);
}

}  // namespace
}  // namespace clerestory
