#include "host/ops/nn/encode.hpp"

#include <gtest/gtest.h>

namespace clerestory {
namespace {

TEST(Encode, OctavesBeginAtHalfACycle) {
  const Tensor b = octave_frequencies(2, 3);
  EXPECT_EQ(b.shape, (Shape{6, 2, 1, 1}));
  EXPECT_EQ(b.at(0, 0, 0, 0), 0.5);
  EXPECT_EQ(b.at(2, 0, 0, 0), 2);
  EXPECT_EQ(b.at(2, 1, 0, 0), 0);
  EXPECT_EQ(b.at(3, 1, 0, 0), 0.5);
  Graph g;
  EXPECT_THROW(encode(g.input("x", {1, 3, 2, 2}), g.input("b", {4, 2, 1, 1})), Error);
}

}  // namespace
}  // namespace clerestory
