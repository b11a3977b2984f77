// The strongest simple answer to what lights a photograph: one radiance from everywhere, fitted as lamps are.
#pragma once
#include <array>

namespace clerestory {

class Device;
struct Scene;
struct RenderSettings;

/// The radiance of `light = constant` under which the photograph's surfaces look most as they do: of each channel the
/// least squares solution over all pixels that neither emit nor face away, weighted as fit_lamps() weighs them.
/// Re-rendered once with settings' sampler and samples. Black where nothing can be lit.
std::array<double, 3> fit_constant(Device& device, const Scene& scene, RenderSettings settings);

}  // namespace clerestory
