// Rays in the order of the pixels that they hit (kernels/light/sort_rays.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

struct SortedRays {
  Value order;   // Int {1, 1, pixels, samples}: ray numbers p * samples + s, by pixel of the batch; misses last
  Value starts;  // Int {1, 1, 1, n h w + 1}: where the rays of each pixel begin in `order`; the last: where misses do
};

/// hit Int {1, 1, pixels, samples}: pixel y * w + x of the ray's own picture, or -1. `map`: {n, C, h, w}, the pictures.
/// Rays of one pixel keep their order.
SortedRays sort_rays(Value hit, const Shape& map);

}  // namespace clerestory
