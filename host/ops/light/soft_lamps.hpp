// Soft lamps: light that a photograph does not show, as Gaussian blobs in space (kernels/light/soft_lamps.cl).
#pragma once
#include "host/graph/graph.hpp"
#include "host/ops/light/rays.hpp"

namespace clerestory {

/// Rays {1, C, P, S} that lamps light up: points {1, 3, P, S}, or {1, 3, P, 1} for all rays of a row; direction 3
/// channels, (0, 0, 0) is none; u 1 channel, the share of each ray that no visible surface answers for (SsrtHits::u).
struct LampRays {
  Value points, direction, u;
  Lobes lobes;
};

/// radiance {1, 3, P, S} + u sum_k color_k seen_k exp(-(r / size)^2 (1 - cos theta)), r the distance to a lamp's
/// middle and theta the angle between ray and it: a spherical Gaussian as a blob of that size in space shows itself.
/// seen_k = 1 - specular (1 - share_k), share_k = min(1, one over the lobe's density over the lamp's solid angle): a
/// Lambertian surface sees all of a lamp, a lobe narrower than it that much less; all of it without lobes. places
/// {1, 4, 1, K}: middle (camera metres) and size > 0; colors {1, 3, 1, K}. Gradients go to radiance, colors and lobes.
Value add_lamps(Value radiance, const LampRays& rays, Value places, Value colors);

/// What one unit of each lamp adds to each row: sums over its rays of weight {1, 3, P, S} times u, shape and what is
/// seen of it, {P, 3, 1, K}. No gradient: it is the matrix of a linear problem.
Value weigh_lamps(Value weight, const LampRays& rays, Value places);

}  // namespace clerestory
