// The pyramid of largest inverse depths that rays march over (kernels/light/depth_pyramid.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Where the levels of a picture's pyramid lie: level l is ceil(w / 2^l) x ceil(h / 2^l) cells from row
/// level_rows - (level_rows >> l), in rows of `stride`.
struct PyramidLayout {
  int levels = 0, level_rows = 0, stride = 0;
  int row(int level) const { return level_rows - (level_rows >> level); }
};
PyramidLayout pyramid_layout(int w, int h);

/// depth {n, 1, h, w}, axial, metres, 0 (or infinity, or NaN) = none -> {n, 1, level_rows, stride}. No gradient.
Value depth_pyramid(Value depth);

}  // namespace clerestory
