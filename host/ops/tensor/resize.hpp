// Resampling of planes (kernels/tensor/resize.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Bilinear, corners aligned: output i reads the input at i (in - 1) / (out - 1).
Value resize_bilinear(Value x, int height, int width);

/// Mean over each output pixel's box (area filter). No gradient: it prepares pictures.
Value resize_area(Value x, int height, int width);

/// The pixel that holds the output pixel's centre, floor((i + 0.5) in / out). No gradient: for masks and target maps.
Value resize_nearest(Value x, int height, int width);

}  // namespace clerestory
