// Hits of a picture as cells of another grid over it (kernels/light/rescale_hits.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// hit Int {1, 1, pixels, samples}: pixel y * w + x of a picture of `from`'s size, or -1 -> the cell of a grid of
/// `to`'s size that holds the pixel's centre. Only h and w of the shapes count.
Value rescale_hits(Value hit, const Shape& from, const Shape& to);

}  // namespace clerestory
