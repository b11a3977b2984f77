// The points that a depth map shows (kernels/light/surface_points.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// depth {n, 1, h, w}, axial metres, and camera {n, 4, 1, 1} -> {n, 3, h, w}, camera metres; (0, 0, 0) without depth.
Value surface_points(Value depth, Value camera);
/// Points {1, 3, h, w} for each of a pixel's rays, {1, 3, h w, samples}.
Value ray_origins(Value points, int samples);

}  // namespace clerestory
