// The strongest simple answers to what lights a photograph: one radiance from everywhere, or the photograph itself, as
// bright as its shading says.
#pragma once
#include <array>

#include "nets/soft_lamps.hpp"

namespace clerestory {

class Device;
struct Scene;
struct RenderSettings;

/// What such a fit weighs where nothing else is said: chosen beside the lamps' own, on the same rooms.
inline constexpr FitWeights kConstantFit{0.5, 1};

/// The factors of settings.light, one a channel, with which the photograph's surfaces look most as they do: the least
/// squares solution over all pixels that neither emit nor face away, weighted as fit_lamps() weighs them. Re-rendered
/// once with settings' sampler and samples. Black where nothing can be lit.
std::array<double, 3> fit_level(Device& device, const Scene& scene, RenderSettings settings);

/// The radiance of `light = constant` that fit_level() finds.
std::array<double, 3> fit_constant(Device& device, const Scene& scene, RenderSettings settings);

}  // namespace clerestory
