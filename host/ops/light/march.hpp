// Where a volume is looked at along rays (kernels/light/march.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

struct MarchOptions {
  int segments = 64;
  double near = 0.05, radius = 3;  // in units of the scene's scale; the sphere is around the camera
  bool jitter = true;  // false: the middle of each piece, for results that do not depend on how rays are listed
};

struct Marched {
  Value position;  // {segments, 3, pixels, samples}: in units of the scene's scale
  Value length;    // {segments, 1, pixels, samples}: to the next position, of the last to the sphere
};

/// points, direction {1, 3, pixels, samples}: camera metres, directions of any length; range {n, 3, 1, 1} by
/// depth_range(); `picture`: h and w tell which picture of the batch a row of rays belongs to. No gradient: points and
/// directions are detached.
Marched march(Value points, Value direction, Value range, const Shape& picture, const MarchOptions& options);

}  // namespace clerestory
