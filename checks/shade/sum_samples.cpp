// Sums over the samples of a chunk, against sums in double.
#include "host/ops/shade/sum_samples.hpp"

#include "checks/op_case.hpp"

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

}  // namespace
}  // namespace clerestory
