// The in-view light's MLP along rays, with gradients: all layers of a few rays in one kernel, forward and back
// (kernels/light/ray_mlp.cl). What conv, add and relu give together, to rounding.
#pragma once
#include "host/ops/light/light_mlp.hpp"

namespace clerestory {

inline constexpr int kMostMlpFeatures = 1024;

/// The last layer's numbers f {1, 3, P, S}, before any output activation. input {1, width (2 width with `again`), P,
/// S}: what is added to the sums of the layers that read it, layer 0's first; encoded {1, E, P, S}, E at most
/// kMostMlpFeatures. `width` is at most kMostMlpWidth.
Value ray_mlp(const LightMlp& mlp, Value input, Value encoded);

}  // namespace clerestory
