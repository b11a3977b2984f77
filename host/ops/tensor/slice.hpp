// A run of channels: a view where memory allows it.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Channels [first, first + count) of {N, C, H, W}.
Value slice(Value x, int first, int count);

}  // namespace clerestory
