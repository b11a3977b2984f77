// Volume rendering along rays (kernels/light/composite.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

struct Composited {
  Value radiance;       // {1, 3, pixels, samples}
  Value transmittance;  // {1, 1, pixels, samples}: what is left of light from behind the last segment
};

/// K segments of each ray, the nearest first: density {K, 1, pixels, samples} (1 / length unit, >= 0), colour {K, 3,
/// ...} radiance, length {K, 1, ...}. Gradients go to density and colour.
Composited composite(Value density, Value colour, Value length);

}  // namespace clerestory
