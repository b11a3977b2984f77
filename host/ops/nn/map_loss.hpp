// Masked losses between maps, each one number (kernels/nn/map_loss.cl). The mask {N, 1, H, W} weighs pixels; the mean
// is over the whole batch, factor * sum_mask e / sum mask, and 0 for an empty mask. Gradients go to the prediction
// alone.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// e = sum over channels of (prediction - truth)^2.
Value squared_loss(Value prediction, Value truth, Value mask, double factor = 1);
/// e = sum over channels of (ln(1 + max(0, s prediction)) - ln(1 + truth))^2; `scale` s {N, 1, 1, 1}, or 1 when absent.
Value log_loss(Value prediction, Value truth, Value mask, double factor = 1, Value scale = {});
/// e = |1 - prediction . truth| over the channels.
Value cosine_loss(Value prediction, Value truth, Value mask, double factor = 1);
/// Per picture the s that minimises sum_mask (s prediction - truth)^2, within [0.001, 1000]; {N, 1, 1, 1}; no gradient.
Value least_squares_scale(Value prediction, Value truth, Value mask);

}  // namespace clerestory
