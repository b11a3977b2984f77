// Light as spherical Gaussians, some a pixel (kernels/light/spherical_gaussians.cl; Li et al. 2020).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// K lobes: axis {., 3 K, ., .}, lobe k's component c in channel 3 k + c, of length 1; sharpness {., K, ., .} at least
/// 0; weight {., 3 K, ., .}. Where in (h, w) they lie says whose they are.
struct Gaussians {
  Value axis, sharpness, weight;

  int lobes() const { return sharpness.shape().c; }
};

/// Sum over lobes of weight exp(sharpness (axis . l - 1)) along `direction` l {1, 3, P, S}, unit, (0, 0, 0): none and
/// 0. Lobes in axis {1, 3 K, P, S} are each ray's own, those in {1, 3 K, P, 1} all of their row's. Gradients go to
/// lobes and directions; as the exponent is formed from |axis - l|^2, those to a unit axis or direction are right along
/// the sphere.
Value spherical_gaussians(const Gaussians& lobes, Value direction);

/// The same light at `points` {1, 3, P, S}, or {1, 3, P, 1} for all rays of a row, camera metres: of lobes in maps
/// {1, ., h, w} those of the cell that the point is seen in by `camera` {1, 4, 1, 1} (point_cells). For inference:
/// asking for a gradient throws.
Value gaussians_of_points(const Gaussians& maps, Value camera, const Shape& picture, Value points, Value direction);

/// The cells of a `grid` over `picture`, whose camera it is, that points {1, 3, P, S} are seen in: Int {1, 1, P, S},
/// row by row. Beside the picture or behind the camera one of the grid's edge. Only h and w of the shapes count.
Value point_cells(Value points, Value camera, const Shape& picture, const Shape& grid);

/// Axis, sharpness and weight of {1, ., h, w} at cells Int {1, 1, P, S}: {1, ., P, S}, with their gradients.
Gaussians gather_gaussians(const Gaussians& maps, Value cells);

/// Axes {n, 3 K, h, w} in the frame of the hemisphere above each pixel (hemisphere_frame of `normal` {n, 3, h, w}, of
/// any length, which has no gradient) as axes in camera space.
Value turn_to_camera(Value axis, Value normal);

}  // namespace clerestory
