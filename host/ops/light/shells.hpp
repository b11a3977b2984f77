// Light from painted spheres around the camera (kernels/light/shells.cl).
#pragma once
#include <vector>

#include "host/graph/graph.hpp"

namespace clerestory {

struct ShellSamples {
  Value value;  // {K, 4, pixels, samples}
  Value met;    // {K, 1, pixels, samples}: 1 where the ray leaves the sphere ahead, always on the last
};

/// shells {K, 4, rows, columns}: panoramas, the innermost first, at least 2 x 2; points, direction {1, 3, pixels,
/// samples}: camera metres, any length; range {1, 3, 1, 1} by depth_range(), whose first is the unit of `radii`, one a
/// sphere. A ray reads a sphere where it leaves it; where it does not, the last by its own direction, the others not at
/// all. The gradient goes to the shells alone, summed in the order of the rays; not inside of map_chunks.
ShellSamples look_up_shells(Value shells, Value points, Value direction, Value range, const std::vector<double>& radii);

}  // namespace clerestory
