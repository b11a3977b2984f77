// Sums of squares of tensors (kernels/nn/square_sums.cl): whether all their numbers are finite, and how large they are,
// in one number each.
#pragma once
#include <span>

#include "host/graph/graph.hpp"

namespace clerestory {

/// {1, K, 1, 1}: of each of the K tensors, of any shapes, the sum of its squares.
Value square_sums(std::span<const Value> tensors);

}  // namespace clerestory
