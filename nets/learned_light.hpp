// `light = net` and `light = out_of_view`: LightNet and the out-of-view field (Zhu et al. 2022, sections 4.2, 4.3)
// asked for the radiance along rays of a scene. `light = completed`: the photograph itself in LightNet's place.
#pragma once
#include "nets/scene_light.hpp"

namespace clerestory {

/// Both parts mixed by the hit's uncertainty (Eq. 6), the photograph in view and the field, or the field alone. The
/// nets read the photograph scaled so that its 95th percentile of luminance is 0.9, with nets.longer_side pixels along
/// its longer side; what they answer is scaled back. The residual output multiplies the photograph itself, at its full
/// size. Where shares_answers() of `rays_to_come` the in-view part answers from a grid of directions around each
/// surface (in_view_answers), and no list is made of the rays that have a share of a part. Throws usage_error when a
/// state is missing or has another shape.
SceneLight learned_light(Graph& graph, const SceneValues& values, const Scene& scene, const RenderSettings& settings,
                         double rays_to_come);

/// `light = li2020`: the light's net of Li et al. 2020 on the same small pictures. Wherever a ray starts it has the
/// light of the pixel that the point is seen at: their light is known at surfaces in view alone, and over the whole
/// sphere their lobes go on beneath a surface as above it. Throws as learned_light().
SceneLight li2020_scene_light(Graph& graph, const Scene& scene, const SceneValues& values,
                              const RenderSettings& settings);

/// Least share of a part in Eq. 6 that is asked for: a ray's in-view part is left out when 1 - u is not above it, its
/// out-of-view part when u is not.
inline constexpr double kLeastShare = 1e-3;

/// Share of mirrors among the surfaces above which answers are not shared. In two rooms of the validation list
/// (320x240, 64 samples) with mirrors of roughness 0.05 on a quarter, half, three quarters and all of their tiles,
/// shared answers moved the re-render by a root relMSE of 0.011 to 0.013, 0.018 to 0.019, 0.024 to 0.026 and 0.028 to
/// 0.032: above half they alone are more than an error of 0.02 that is asked for.
inline constexpr double kMostMirrors = 0.5;

/// Whether about so many rays of this scene are answered from a grid.
bool shares_answers(const Scene& scene, const RenderSettings& settings, double rays);
/// What of the scene speaks against it, where that alone decides, in words; else empty.
std::string why_none_are_shared(const Scene& scene, const RenderSettings& settings, double rays);

}  // namespace clerestory
