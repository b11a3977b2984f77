// Sums and means in a fixed order.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// factor * (x summed along every axis where `to` has size 1). `to` agrees with x elsewhere; height and width go
/// together.
Value sum_to(Value x, const Shape& to, double factor = 1);
/// Sum and mean of all elements; 1x1x1x1.
Value sum(Value x);
Value mean(Value x);
/// Mean over the plane of each channel: {N, C, 1, 1} (global average pooling).
Value plane_mean(Value x);

}  // namespace clerestory
