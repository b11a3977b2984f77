// Radiance along rays that may meet an inserted object before they meet the scene (kernels/shade/nearer.cl). Detached.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

struct NearerRays {
  Value points;     // {1, 3, pixels, samples}, or {1, 3, h, w} where they are of_pixels
  Value direction;  // {1, 3, pixels, samples}
  Value hit;        // Int: pixel of the scene, -1 on a miss
  Value object;     // Int: -1 on a miss
  Value distance;   // to the object, in units of the direction's length
  bool of_pixels = false;
};

/// `scene`: radiance of the scene along the rays; weight * beyond: what the object reflects, all {1, 3, pixels,
/// samples}. `depth` {1, 1, h, w} and `camera` {1, 4, 1, 1} of the scene. With `shows` {1, 1, h, w}, 1 where a pixel
/// shows an object: elsewhere the scene's radiance is taken away, and sums give what the objects change.
Value nearer(const NearerRays& rays, Value scene, Value weight, Value beyond, Value depth, Value camera,
             Value shows = {});

/// direction {1, 3, pixels, samples} of the rays whose light nearer() with `shows` can tell: those that meet an object,
/// and all of pixels that show one; (0, 0, 0), no ray, elsewhere.
Value needed_rays(Value direction, Value object, Value shows);

}  // namespace clerestory
