// Adam (kernels/nn/adam.cl): the update of parameters from their gradients, on the device.
#pragma once
#include <span>

#include "host/graph/graph.hpp"

namespace clerestory {

struct AdamOptions {
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
};

/// Appends updates of all parameters (states), a few in each node: one runs as soon as its gradients are there and its
/// parameters are read no more, so that not all gradients are kept. Learning rate and step (1 for the first) are values
/// 1x1x1x1. The moments are states named "adam.m.<parameter>" and "adam.v.<parameter>". Throws Error naming a parameter
/// whose gradient is empty. Returns {1, 2 K, 1, 1}: of each of the K parameters the sum of the squares of its gradient,
/// then of itself before the update (square_sums.hpp); no value where there is no parameter.
Value adam(std::span<const Value> parameters, std::span<const Value> gradients, Value learning_rate, Value step,
           const AdamOptions& options = {});

}  // namespace clerestory
