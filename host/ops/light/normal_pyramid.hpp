// Boxes around the normals of blocks, over which rays pass that see them from behind (kernels/light/normal_pyramid.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// normal {n, 3, h, w}, of any length -> Int {n, 1, level_rows, 2 stride}, cells where pyramid_layout(w, h) has those
/// of depths, each two packed corners. No gradient.
Value normal_pyramid(Value normal);

}  // namespace clerestory
