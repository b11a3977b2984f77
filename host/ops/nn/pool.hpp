// Pooling with stride 2 (kernels/nn/pool.cl). Global average pooling is plane_mean (host/ops/tensor/reduce.hpp).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Mean of 2x2; {N, C, H, W} -> {N, C, H/2, W/2}, rounded down.
Value average_pool(Value x);
struct MaxPoolSpec {
  int window = 3, pad = 1;  // ResNet's; VGG's is 2 and 0
};
/// Maximum over a window, stride 2; {N, C, H, W} -> {N, C, (H + 2 pad - window)/2 + 1, ...}. Padding is never chosen.
Value max_pool(Value x, const MaxPoolSpec& spec = {});

}  // namespace clerestory
