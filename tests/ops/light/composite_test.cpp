#include "host/ops/light/composite.hpp"

#include <gtest/gtest.h>

namespace clerestory {
namespace {

TEST(Composite, ShapesAreChecked) {
  Graph g;
  const Value density = g.input("density", {4, 1, 2, 16});
  EXPECT_THROW(composite(density, g.input("colour", {4, 3, 2, 32}), density), Error);
  EXPECT_THROW(composite(density, g.input("colour2", {3, 3, 2, 16}), density), Error);
}

}  // namespace
}  // namespace clerestory
