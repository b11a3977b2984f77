// Resampling of planes (kernels/tensor/resize.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Where output i reads the input. Corners: at i (in - 1) / (out - 1). Centres: at (i + 1/2) in / out - 1/2, and beyond
/// the outer centres what these hold (PyTorch's align_corners = true and false).
enum class Aligned { Corners, Centres };

/// Bilinear.
Value resize_bilinear(Value x, int height, int width, Aligned aligned = Aligned::Corners);

/// Mean over each output pixel's box (area filter). No gradient: it prepares pictures.
Value resize_area(Value x, int height, int width);

/// The pixel that holds the output pixel's centre, floor((i + 0.5) in / out). No gradient: for masks and target maps.
Value resize_nearest(Value x, int height, int width);

}  // namespace clerestory
