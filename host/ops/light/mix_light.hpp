// Two lights mixed by how sure a hit is: Zhu et al. 2022, Eq. 6 (kernels/light/mix_light.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// (1 - u) near + u far: `near` what the hit pixel sends, `far` the light of what is not seen, both
/// {1, 3, pixels, samples}; u {1, 1, pixels, samples}, SsrtHits::u.
Value mix_light(Value near, Value far, Value u);

}  // namespace clerestory
