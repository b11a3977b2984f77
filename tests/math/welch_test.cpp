// Welch's test against tables of Student's t.
#include "host/math/welch.hpp"

#include <gtest/gtest.h>

namespace clerestory {
namespace {

TEST(Welch, PValuesAreStudents) {
  // Equal variances of three values each: four degrees of freedom; t = 2 has p = 0.1161.
  EXPECT_NEAR(*p_of_shifts({{2, {0.5, 0.5}, {3, 3}}}), 0.1161, 1e-4);
  // Two rooms add up: t = 4 / sqrt 2, eight degrees: p = 0.0222.
  EXPECT_NEAR(*p_of_shifts({{2, {0.5, 0.5}, {3, 3}}, {2, {0.5, 0.5}, {3, 3}}}), 0.0222, 1e-4);
  EXPECT_FALSE(p_of_shifts({{2, {0, 0}, {3, 3}}})) << "no spread";
}

}  // namespace
}  // namespace clerestory
