// Sums over the samples of a chunk, against sums in double.
#include "host/ops/shade/sum_samples.hpp"

#include <gtest/gtest.h>

#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

constexpr int kPixels = 5, kSamples = 48;

OP_CASES(sum_samples) {
  OpCase c{.stem = "sum_samples", .label = "rows", .kernels = {"sum_samples"}};
  c.inputs = {{"x", random_tensor({1, 5, kPixels, kSamples}, 1)}};
  c.build = [](Graph&, const Values& v) { return std::vector{sum_samples(v.at("x"))}; };
  c.reference = [](const Tensors& t) {
    Tensor sum(Shape{1, 5, kPixels, 1});
    for (int k = 0; k < 5; ++k)
      for (int p = 0; p < kPixels; ++p)
        for (int s = 0; s < kSamples; ++s) sum.at(0, k, p, 0) += t.at("x").at(0, k, p, s);
    return std::vector{sum};
  };
  c.roundings = 8, c.magnitude = kSamples;
  c.no_gradient = "a part of adjoints itself";
  return {c};
}

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
      EXPECT_NEAR(got.at(0, c, p, 0), sum, 1e-14) << c << " " << p;
    }
}

}  // namespace
}  // namespace clerestory
