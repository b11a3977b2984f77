// Maps laid out pixel by pixel.
#include "host/ops/light/pixel_rows.hpp"

#include <gtest/gtest.h>

namespace clerestory {
namespace {

TEST(PixelRows, ArgumentsAreChecked) {
  Graph g;
  const Value surface = g.input("surface", {1, 4, 6, 8});
  EXPECT_THROW(pixel_rows(surface, g.input("a", {1, 3, 6, 8})), Error);
  EXPECT_THROW(pixel_rows(surface, g.input("b", {2, 4, 6, 8})), Error);
  const Value y = pixel_rows(surface, g.input("c", {1, 4, 3, 4}));
  EXPECT_THROW(gradient(std::vector{y}, std::vector{g.fill(y.shape(), 1)}, std::vector{surface}), Error);
}

}  // namespace
}  // namespace clerestory
