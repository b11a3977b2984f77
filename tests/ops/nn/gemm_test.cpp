// Matrix products: what is refused.
#include "host/ops/nn/gemm.hpp"

#include <gtest/gtest.h>

namespace clerestory {
namespace {

TEST(Gemm, RefusesWhatDoesNotFit) {
  Graph g;
  const Value a = g.input("a", {1, 1, 3, 4});
  EXPECT_THROW(matmul(a, g.input("b", {1, 1, 5, 6})), Error);
  EXPECT_THROW(matmul(a, g.input("c", {1, 1, 3, 4}), {true, true}), Error);
  EXPECT_THROW(matmul(a, g.input("d", {2, 4, 3, 3})), Error);
}

}  // namespace
}  // namespace clerestory
