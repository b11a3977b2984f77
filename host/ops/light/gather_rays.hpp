// What a map holds at the pixels that rays hit (kernels/light/gather_rays.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// map {n, C, h, w}, hit Int {1, 1, pixels, samples} (y * w + x of the ray's own picture, or -1) -> {1, C, pixels,
/// samples}, 0 on a miss. The gradient is summed pixel by pixel in the order of the rays: same bits run to run.
Value gather_rays(Value map, Value hit);
/// Its transpose: rays {1, C, pixels, samples} summed into a map of this shape.
Value scatter_rays(Value rays, Value hit, const Shape& map);

}  // namespace clerestory
