// Rays that hit inserted objects go on (kernels/shade/bounce.cl), and what they bring back competes with the scene
// (kernels/shade/nearer.cl). For applications: both are detached.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

struct Bounce {
  Value direction;  // {1, 3, pixels, samples}: unit; (0, 0, 0): the ray ends
  Value weight;     // {1, 3, pixels, samples}: f cos / pdf
  Value widest;     // {1, 1, pixels, samples}: the smaller of pdf and the arriving ray's own
};

/// direction, normal {1, 3, pixels, samples}; arriving {1, 1, ...}: the rays' pdf, 1/sr, or of the widest lobe of a
/// longer path; object Int {1, 1, ...}, -1: none; materials {objects, 5, 1, 1}: albedo,
/// roughness, metallic. `number`: of the bounce, 1 for the first; it keys the random numbers.
Bounce bounce(Value direction, Value arriving, Value normal, Value object, Value materials, int number);

}  // namespace clerestory
