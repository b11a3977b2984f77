// Soft lamps: light that a photograph does not show, as Gaussian blobs in space (kernels/light/soft_lamps.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Rays {1, C, P, S} that lamps light up: points {1, 3, P, S}, or {1, 3, P, 1} for all rays of a row; direction 3
/// channels, (0, 0, 0) is none; u 1 channel, the share of each ray that no visible surface answers for (SsrtHits::u);
/// pdf 1 channel, 1/sr, of the sampling that drew the ray, 0: no surface asks.
struct LampRays {
  Value points, direction, u, pdf;
};

/// radiance {1, 3, P, S} + u sum_k color_k share_k exp(-(r / size)^2 (1 - cos theta)), r the distance to a lamp's
/// middle and theta the angle between ray and it: a spherical Gaussian as a blob of that size in space shows itself.
/// share_k = min(1, solid angle of the ray, 1 / pdf, over the lamp's): a lobe narrower than a lamp does not see it
/// whole. places {1, 4, 1, K}: middle (camera metres) and size > 0; colors {1, 3, 1, K}. Gradients go to radiance and
/// colors.
Value add_lamps(Value radiance, const LampRays& rays, Value places, Value colors);

/// What one unit of each lamp adds to each row: sums over its rays of weight {1, 3, P, S} times u times the lamp's
/// shape, {P, 3, 1, K}. No gradient: it is the matrix of a linear problem.
Value weigh_lamps(Value weight, const LampRays& rays, Value places);

}  // namespace clerestory
