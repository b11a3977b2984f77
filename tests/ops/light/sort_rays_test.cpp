// The order of rays by the pixels that they hit, against std::stable_sort.
#include "host/ops/light/sort_rays.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

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
