// Light from a small radiance field in one kernel: march, positional encoding, MLP, compositing; nothing between them
// goes through memory (kernels/light/ask_field.cl). For inference: the same numbers, to rounding, as march, encode,
// conv, activate and composite together, which have gradients.
#pragma once
#include <span>

#include "host/ops/light/march.hpp"
#include "host/ops/light/select_rays.hpp"

namespace clerestory {

inline constexpr int kMostFieldLayers = 5, kMostFieldWidth = 64;

struct FieldOptions {
  MarchOptions march;
  int octaves = 6;              // 0 to 10: the field reads [x, sin(2^k x), cos(2^k x)], k below it, x in scene scales
  bool released_output = true;  // relu for colour and density; false: softplus
};

/// Radiance {1, 3, P, S}: what arrives at `points` along `directions` (which point away, any length); 0 for rays that
/// `list` leaves out. weights {out, in, 1, 1} and biases {1, out, 1, 1} of one picture's field, first layer to last: 1
/// to kMostFieldLayers layers, from 3 + 6 octaves numbers to 4 (red, green, blue, density), at most kMostFieldWidth
/// wide, relu between them.
/// points: camera metres, {1, 3, P, S}, or {1, 3, P, 1} where all rays of a row start at one point. directions {1, 3,
/// P, S}. range {1, 3, 1, 1} by depth_range(). background {1, 3, 1, 1}: radiance behind the field, none: black. What
/// lies behind an optical depth of 14 (transmittance 8e-7) is not looked at. A ray's answer does not depend on the
/// other rays. Asking for a gradient throws. Under --gemm clblast the same by products of blocks of points.
Value ask_field(std::span<const Value> weights, std::span<const Value> biases, Value points, Value directions,
                Value range, const RayList& list, const FieldOptions& options, Value background = {});

}  // namespace clerestory
