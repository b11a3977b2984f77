// Vectors of three channels brought to length 1 (kernels/nn/unit_vector.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// t / max(|t|, 1e-6) for each pixel of {N, 3, H, W}.
Value unit_vector(Value t);

}  // namespace clerestory
