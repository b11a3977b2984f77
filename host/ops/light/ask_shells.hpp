// Light from painted spheres in one kernel: look-up and compositing; nothing between them goes through memory
// (kernels/light/ask_shells.cl). For inference: the same numbers, to rounding, as look_up_shells and composite
// together, which have gradients.
#pragma once
#include <vector>

#include "host/ops/light/select_rays.hpp"

namespace clerestory {

/// Radiance {1, 3, P, S}: what arrives at `points` along `directions` (which point away, any length); 0 for rays that
/// `list` leaves out. shells {K, 4, rows, columns}, range and radii as of look_up_shells(). points: camera metres,
/// {1, 3, P, S}, or {1, 3, P, 1} where all rays of a row start at one point. A ray's answer does not depend on the
/// other rays. Asking for a gradient throws.
Value ask_shells(Value shells, Value points, Value directions, Value range, const RayList& list,
                 const std::vector<double>& radii);

}  // namespace clerestory
