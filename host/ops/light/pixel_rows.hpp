// What an MLP's layers owe to each pixel, laid out for rays to look up (kernels/light/pixel_rows.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// surface {1, C, h, w} plus features {1, C, h', w'} at the cell that holds the pixel's centre (rescale_hits), pixel by
/// pixel: {1, 1, h w, C}, so that a ray finds the numbers of the pixel it hits side by side. Once per picture, outside
/// of map_chunks. Asking for a gradient throws.
Value pixel_rows(Value surface, Value features);

}  // namespace clerestory
