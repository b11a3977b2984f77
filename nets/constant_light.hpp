// The strongest simple answer to what lights a photograph: one radiance from everywhere, fitted as lamps are.
#pragma once
#include <array>

#include "nets/soft_lamps.hpp"

namespace clerestory {

class Device;
struct Scene;
struct RenderSettings;

/// What such a fit weighs where nothing else is said: chosen beside the lamps' own, on the same rooms.
inline constexpr FitWeights kConstantFit{0.5, 1};

/// The radiance of `light = constant` under which the photograph's surfaces look most as they do: of each channel the
/// least squares solution over all pixels that neither emit nor face away, weighted as fit_lamps() weighs them.
/// Re-rendered once with settings' sampler and samples. Black where nothing can be lit.
std::array<double, 3> fit_constant(Device& device, const Scene& scene, RenderSettings settings);

}  // namespace clerestory
