// Group normalisation (kernels/nn/group_norm.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// x {N, C, H, W} normalised over each of `groups` runs of C / groups channels, times gamma plus beta {1, C, 1, 1},
/// then ReLU if `relu`.
Value group_norm(Value x, Value gamma, Value beta, int groups, bool relu, double epsilon = 1e-5);

}  // namespace clerestory
