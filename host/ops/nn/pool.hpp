// Pooling with stride 2 (kernels/nn/pool.cl). Global average pooling is plane_mean (host/ops/tensor/reduce.hpp).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Mean of 2x2; {N, C, H, W} -> {N, C, H/2, W/2}, rounded down.
Value average_pool(Value x);
/// Maximum of 3x3 with padding 1; {N, C, H, W} -> {N, C, (H-1)/2+1, (W-1)/2+1}.
Value max_pool(Value x);

}  // namespace clerestory
