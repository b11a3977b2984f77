#include "host/ops/nn/depthwise.hpp"

#include <gtest/gtest.h>

namespace clerestory {
namespace {

std::string refusal(const Shape& w, const Shape& bias, int stride) {
  Graph g;
  try {
    depthwise(g.input("x", {1, 4, 8, 8}), g.input("w", w), g.input("bias", bias), stride);
  } catch (const Error& e) {
    return e.what();
  }
  return {};
}

TEST(Depthwise, WhatDoesNotFitIsRefused) {
  EXPECT_EQ(refusal({4, 1, 3, 3}, {1, 4, 1, 1}, 2), "");
  EXPECT_NE(refusal({4, 1, 4, 4}, {1, 4, 1, 1}, 1).find("3 or 5"), std::string::npos);
  EXPECT_NE(refusal({4, 1, 3, 3}, {1, 4, 1, 1}, 3).find("stride 3"), std::string::npos);
  EXPECT_NE(refusal({4, 4, 3, 3}, {1, 4, 1, 1}, 1).find("4x1x3x3"), std::string::npos);
  EXPECT_NE(refusal({4, 1, 3, 3}, {1, 3, 1, 1}, 1).find("bias"), std::string::npos);
}

TEST(Depthwise, ZerosLieAsTensorflowHasThem) {
  EXPECT_EQ(same_padding(10, 3, 1), 1);
  EXPECT_EQ(same_padding(10, 3, 2), 0);  // one, behind
  EXPECT_EQ(same_padding(11, 3, 2), 1);
  EXPECT_EQ(same_padding(10, 5, 2), 1);  // three
  EXPECT_EQ(same_padding(11, 5, 2), 2);
  EXPECT_EQ(same_padding(1, 5, 2), 2);
}

}  // namespace
}  // namespace clerestory
