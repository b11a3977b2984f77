// Features gathered at hits and summed back, and the sort behind it.
#include "host/ops/light/gather_rays.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "host/graph/map_chunks.hpp"
#include "host/ops/light/sort_rays.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

constexpr Shape kMap{2, 5, 4, 6};
constexpr int kRows = 2 * 24;

std::vector<Tensor> sorted_reference(const Tensor& hit, const Shape& map) {
  const int keys = static_cast<int>(map.n * map.plane()), plane = static_cast<int>(map.plane());
  std::vector<int> key(hit.integer.size());
  for (std::size_t i = 0; i < key.size(); ++i) {
    const int first = static_cast<int>(i) / hit.shape.w / plane * plane;
    key[i] = hit.integer[i] < 0 ? keys : first + hit.integer[i];
  }
  Tensor order = hit, starts = random_ints({1, 1, 1, keys + 1}, 1, 0, 1);
  std::iota(order.integer.begin(), order.integer.end(), 0);
  const auto key_of = [&](int ray) { return key[static_cast<std::size_t>(ray)]; };
  std::stable_sort(order.integer.begin(), order.integer.end(), [&](int a, int b) { return key_of(a) < key_of(b); });
  for (int k = 0; k <= keys; ++k)
    starts.integer[static_cast<std::size_t>(k)] =
        static_cast<int>(std::count_if(key.begin(), key.end(), [&](int value) { return value < k; }));
  return {order, starts};
}

OpCase sort_case(const std::string& label, const Shape& map, int rows, int samples, int low, int high) {
  OpCase c{.stem = "sort_rays", .label = label};
  c.kernels = {"ray_keys", "count_digits", "begin_digits", "place_by_digit", "segment_starts"};
  c.inputs = {{"hit", random_ints({1, 1, rows, samples}, 3, low, high)}};
  c.build = [map](Graph&, const Values& v) {
    const SortedRays s = sort_rays(v.at("hit"), map);
    return std::vector{s.order, s.starts};
  };
  c.reference = [map](const Tensors& t) { return sorted_reference(t.at("hit"), map); };
  c.no_gradient = "integers";
  return c;
}

OP_CASES(sort_rays) {
  return {sort_case("one_digit", {1, 3, 4, 6}, 24, 16, -2, 24),  //
          sort_case("two_digits_and_blocks", {2, 1, 20, 16}, 640, 16, -20, 320),
          sort_case("three_digits", {1, 1, 260, 256}, 300, 16, -100, 66560),
          sort_case("all_misses", {1, 1, 4, 6}, 24, 16, -1, 0),  //
          sort_case("one_pixel", {1, 1, 20, 16}, 320, 16, 319, 320)};
}

OP_CASES(gather_rays) {
  OpCase c{.stem = "gather_rays", .label = "batch"};
  c.kernels = {"gather_rays", "sum_segments"};
  c.inputs = {{"map", random_tensor(kMap, 1)}, {"hit", random_ints({1, 1, kRows, 16}, 2, -4, 24)}};
  c.build = [](Graph&, const Values& v) { return std::vector{gather_rays(v.at("map"), v.at("hit"))}; };
  c.reference = [](const Tensors& t) {
    Tensor y(Shape{1, kMap.c, kRows, 16});
    for (int p = 0; p < kRows; ++p)
      for (int s = 0; s < 16; ++s) {
        const int pixel = t.at("hit").integer[static_cast<std::size_t>(p * 16 + s)];
        for (int k = 0; k < kMap.c; ++k)
          y.at(0, k, p, s) = pixel < 0 ? 0 : t.at("map").at(p / 24, k, pixel / kMap.w, pixel % kMap.w);
      }
    return std::vector{y};
  };
  c.differentiate = {"map"};
  c.step = 1e-2, c.gradient_tolerance = 1e-10;  // linear: a difference is exact but for rounding
  return {c};
}

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

}  // namespace
}  // namespace clerestory
