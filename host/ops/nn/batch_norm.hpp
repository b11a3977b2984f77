// Batch normalisation in two ops, so that moments are computed once per feature and shared by all layers that normalise
// it (kernels/nn/batch_norm.cl). Moments are {1, C, 1, 2}: mean and biased variance of each channel; they concatenate
// along channels as the features do.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Mean and biased variance of each channel of {N, C, H, W} over batch and plane.
Value channel_moments(Value x);

/// gamma (x - mean) / sqrt(variance + epsilon) + beta, per channel, then ReLU if `relu`. gamma, beta: {1, C, 1, 1}.
Value normalise_channels(Value x, Value moments, Value gamma, Value beta, bool relu, double epsilon = 1e-5);

/// The moments for inference, from running statistics {1, C, 1, 1}; no gradient.
Value running_moments(Value running_mean, Value running_variance);

/// Appends the update of running statistics (states) by the moments of a batch with `count` numbers per channel.
/// PyTorch's convention: new = (1 - momentum) old + momentum batch, variance unbiased.
void update_running(Value moments, Value running_mean, Value running_variance, long count, double momentum = 0.1);

}  // namespace clerestory
