// Lights without a network: radiance that arrives along rays {1, 3, pixels, samples} (kernels/light/image_light.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// The photograph `image` {n, 3, h, w} at the pixel a ray hits (SsrtHits::pixel), `ambient` {n, 3, 1, 1} on a miss.
/// Both have gradients, summed in a fixed order.
Value image_light(Value image, Value ambient, Value hit_pixel);
/// (1 - u) times that and u times the ambient: mix_light() with constant_light(), in one pass. u {1, 1, pixels,
/// samples}, SsrtHits::u, has no gradient.
Value image_light(Value image, Value ambient, Value hit_pixel, Value u);
/// `ambient` from everywhere. `rays`: any tensor of the rays, for its shape; `image`: one of the picture's maps, for
/// its size. The ambient has a gradient.
Value constant_light(Value ambient, Value rays, Value image);
/// The photograph at infinity: image_light() at the pixel that `directions` (camera frame) point to through `camera`
/// {n, 4, 1, 1}.
Value panorama_light(Value image, Value ambient, Value camera, Value directions);

/// The same of the photograph mirrored at its borders, so that it is seen all around (mirrored_rays()).
Value mirrored_light(Value image, Value ambient, Value camera, Value directions);

}  // namespace clerestory
