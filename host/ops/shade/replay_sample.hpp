// What lies between a pixel's maps and the direction that sample_brdf() drew (kernels/shade/replay_sample.cl).
#pragma once
#include "host/ops/shade/sample_brdf.hpp"

namespace clerestory {

/// {1, 21, P, S} of the rays of `direction` {1, 3, P, S}, as sample_brdf() with these maps and options gave it in the
/// same run: random numbers 4; frame 9: t, b, n (camera frame); view 3 and light 3 (local frame); alpha; probability
/// of the specular lobe. camera {n, 4, 1, 1}. No gradient.
Value replay_sample(Value camera, const Surfaces& surfaces, Value direction, const SamplingOptions& options);

}  // namespace clerestory
