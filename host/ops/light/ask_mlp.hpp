// The in-view light's MLP in one kernel: lookup of the hit pixel, Fourier features of the direction, all layers;
// nothing between them goes through memory (kernels/light/ask_mlp.cl). For inference: the same numbers, to rounding, as
// gather_rays, encode and ray_mlp together, which have gradients.
#pragma once
#include "host/ops/light/light_mlp.hpp"
#include "host/ops/light/select_rays.hpp"

namespace clerestory {

inline constexpr int kMostMlpFrequencies = 256;

/// The last layer's numbers f {1, 3, P, S}, before any output activation; 0 for rays that `list` leaves out and for
/// misses. rows {1, 1, h w, width (2 width with `again`)} by pixel_rows(): layer 0's share first. hit Int {1, 1, P, S}:
/// y * w + x or -1; direction {1, 3, P, S}. A ray's answer does not depend on the other rays. Asking for a gradient
/// throws. frequencies {m, 3, 1, 1}, cycles per unit of direction; m at most kMostMlpFrequencies, and E = 2 m. `width`
/// is a multiple of 16, at most kMostMlpWidth.
/// Under --gemm clblast the same by products of blocks of rays (host/ops/light/net_layers.hpp).
Value ask_mlp(const LightMlp& mlp, Value frequencies, Value rows, Value hit, Value direction, const RayList& list);

}  // namespace clerestory
