// Sums over a pixel's samples (kernels/shade/sum_samples.cl): how what rays give to a surface meets at its pixel.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// {1, C, pixels, samples} -> {1, C, pixels, 1}.
Value sum_samples(Value rays);

}  // namespace clerestory
