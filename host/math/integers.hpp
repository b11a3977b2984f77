// Whole numbers: how many parts, and up to which multiple.
#pragma once

namespace clerestory {

/// Parts of b that a has, the last perhaps smaller. a >= 0, b > 0.
constexpr int ceil_div(int a, int b) { return (a + b - 1) / b; }
/// The least multiple of b that is not below a.
constexpr int round_up(int a, int b) { return ceil_div(a, b) * b; }

}  // namespace clerestory
