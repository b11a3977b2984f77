// Where pixels look for light that is known of (kernels/shade/light_guide.cl): the guide that sample_brdf() draws by.
#pragma once
#include "host/ops/shade/sample_brdf.hpp"

namespace clerestory {

/// Rows {pixels, 2 + 6 K, 1, 1} of a chunk's pixels, or of all of them outside of map_chunks. depth {n, 1, h, w},
/// camera {n, 4, 1, 1}; `sampling`: the maps that choose directions. lamps {n or 1, 5, 1, K}: middle (camera metres),
/// size (metres, above 0), radiance over that of the rest of the light (0: no lamp). It only chooses: no gradient goes
/// through it.
Value light_guide(Value depth, Value camera, const Surfaces& sampling, Value lamps, int pixels);

}  // namespace clerestory
