// Rays that hit inserted objects go on (kernels/shade/bounce.cl), and what they bring back competes with the scene
// (kernels/shade/nearer.cl). For applications: both are detached.
#pragma once
#include "host/graph/graph.hpp"
#include "host/ops/light/rays.hpp"

namespace clerestory {

struct Bounce {
  Value direction;  // {1, 3, pixels, samples}: unit; (0, 0, 0): the ray ends
  Value weight;     // {1, 3, pixels, samples}: f cos / pdf
  Lobes lobes;      // of the whole path: what met specular lobes alone, and the widest of them; none if none arrive
};

/// direction, normal {1, 3, pixels, samples}; object Int {1, 1, ...}, -1: none; materials {objects, 5, 1, 1}: albedo,
/// roughness, metallic; `arriving`: lobes of the path before. `number`: of the bounce, 1 for the first; it keys the
/// random numbers.
Bounce bounce(Value direction, Value normal, Value object, Value materials, const Lobes& arriving, int number);

}  // namespace clerestory
