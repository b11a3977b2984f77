// `light = net` and `light = out_of_view`: LightNet and the out-of-view field (Zhu et al. 2022, sections 4.2, 4.3)
// asked for the radiance along rays of a scene.
#pragma once
#include "nets/scene_light.hpp"

namespace clerestory {

/// Both parts mixed by the hit's uncertainty (Eq. 6), or without `in_view` the field alone. The nets read the
/// photograph scaled so that its 95th percentile of luminance is 0.9, with nets.longer_side pixels along its longer
/// side; what they answer is scaled back. The residual output multiplies the photograph itself, at its full size.
/// Where shares_answers() of `rays_to_come` the in-view part answers from a grid of directions around each surface
/// (in_view_answers). Throws usage_error when a state is
/// missing or has another shape.
SceneLight learned_light(Graph& graph, const SceneValues& values, const Scene& scene, const RenderSettings& settings,
                         double rays_to_come);

/// Least share of a part in Eq. 6 that is asked for: a ray's in-view part is left out when 1 - u is not above it, its
/// out-of-view part when u is not.
inline constexpr double kLeastShare = 1e-3;

/// Whether about so many rays of this scene are answered from a grid.
bool shares_answers(const Scene& scene, const RenderSettings& settings, double rays);

}  // namespace clerestory
