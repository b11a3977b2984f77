// Hit pixels as cells of other grids.
#include "host/ops/light/rescale_hits.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

OpCase rescale_case(const std::string& label, const Shape& from, const Shape& to) {
  OpCase c{.stem = "rescale_hits", .label = label, .kernels = {"rescale_hits"}};
  c.inputs = {{"hit", random_ints({1, 1, 9, 32}, 2, -1, static_cast<int>(from.plane()))}};
  c.build = [=](Graph&, const Values& v) { return std::vector{rescale_hits(v.at("hit"), from, to)}; };
  c.reference = [=](const Tensors& t) {
    Tensor y = t.at("hit");
    for (std::int32_t& pixel : y.integer) {
      if (pixel < 0) continue;
      const double x = (pixel % from.w + 0.5) * to.w / from.w, row = (pixel / from.w + 0.5) * to.h / from.h;
      pixel = static_cast<int>(std::floor(row)) * to.w + static_cast<int>(std::floor(x));
    }
    return std::vector{y};
  };
  c.no_gradient = "pixels are discrete";
  return c;
}

OP_CASES(rescale_hits) {
  return {rescale_case("half", {1, 1, 6, 8}, {1, 1, 3, 4}), rescale_case("odd", {1, 1, 7, 11}, {1, 1, 4, 6}),
          rescale_case("finer", {1, 1, 3, 4}, {1, 1, 8, 12})};
}

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
