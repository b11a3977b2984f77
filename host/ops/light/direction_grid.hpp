// A net's answers on a grid of directions around each surface, in place of one for each ray
// (kernels/light/direction_grid.cl): where many rays meet few surfaces, most of them come from nearly the same way.
#pragma once
#include "host/ops/light/select_rays.hpp"

namespace clerestory {

/// Rays that meet every pixel's surface from side x side directions over its hemisphere; side^2 is a multiple of 16.
struct GridRays {
  Value direction;  // {1, 3, h w, side^2}: unit, camera frame, towards the surface
  Value pixel;      // Int {1, 1, h w, side^2}: the one that is met
};
/// normal {1, 3, h, w}, camera frame.
GridRays grid_directions(Value normal, int side);

/// Between four answers of `grid` {1, C, h w, side^2}, which are those to grid_directions() of this normal: {1, C, P,
/// S} along `direction` {1, 3, P, S} at the pixel `hit` Int {1, 1, P, S}; 0 on a miss and for rays that `list` leaves
/// out. For inference: asking for a gradient throws.
Value look_up_grid(Value grid, Value normal, Value hit, Value direction, const RayList& list);

}  // namespace clerestory
