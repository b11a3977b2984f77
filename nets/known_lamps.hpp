// Lamps that a scene is known to have, for directions to be drawn towards them (host/ops/shade/light_guide.hpp).
#pragma once
#include <optional>
#include <vector>

#include "host/graph/tensor.hpp"

namespace clerestory {

struct Scene;
struct SoftLamp;
struct RenderSettings;

/// How `sampler` of RenderSettings is called with which directions are drawn towards known lamps, too.
constexpr auto kGuidedSampler = "guided";

/// Bright patches of the photograph, where its surfaces are: pixels of more than three times the radiance of rays that
/// leave the picture (ambient_of), split until patches are small or there are eight; each the soft lamp of its extent
/// and power, its radiance as luminance. None without a bright pixel that has a depth.
std::vector<SoftLamp> bright_patches(const Scene& scene);

/// What settings.light and settings.lamps are known to bring, the twenty brightest: bright patches where the light
/// reads the photograph at surfaces (image, net), fitted lamps under any. {1, 5, 1, K} for light_guide(); nothing when
/// there is none.
std::optional<Tensor> known_lamps(const Scene& scene, const RenderSettings& settings);

}  // namespace clerestory
