// Views: another shape, or the same value without its gradient.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// The same elements in the same NCHW order under another shape of equal count.
Value reshape(Value x, const Shape& shape);

/// The value of x; no gradient passes (a stop gradient).
Value detach(Value x);

}  // namespace clerestory
