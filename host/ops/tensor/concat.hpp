// Concatenation along channels. compile() lets the inputs be written straight to their place in the output.
#pragma once
#include <span>

#include "host/graph/graph.hpp"

namespace clerestory {

/// {N, C1, H, W}, {N, C2, H, W}, ... -> {N, C1 + C2 + ..., H, W}. All inputs agree in N, H and W.
Value concat(std::span<const Value> parts);

}  // namespace clerestory
