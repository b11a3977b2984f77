// From where the cells of a depth map can be hit, by blocks (kernels/light/facing_pyramid.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// depth {n, 1, h, w} and normal {n, 3, h, w} -> Int {n, 1, level_rows, stride}, in the layout of depth_pyramid(): of
/// each block of cells a ball that holds their unit normals. With it ssrt() passes blocks that face away from a ray at
/// once, to the same hits. No gradient.
Value facing_pyramid(Value depth, Value normal);

}  // namespace clerestory
