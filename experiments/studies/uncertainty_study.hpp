// Whether u, by which the two parts of the light are mixed (Zhu et al. 2022, Eq. 6), knows when a hit of screen-space
// ray tracing is not real: against the first surface that the tracer meets along the same ray. Reliability, area under
// the curve, and the constant of u = tanh(constant delta) swept.
#pragma once
#include <string>
#include <vector>

#include "experiments/training/light_views.hpp"
#include "host/io/config.hpp"

namespace clerestory {

/// Keys of its own.
void add_uncertainty_keys(Schema& schema);

/// study.kind = "uncertainty". Returns the run directory. Throws usage_error when there are no weights of the light, or
/// when views have another size than the nets read.
std::string run_uncertainty_study(const Config& config, const std::vector<std::string>& command);

/// Whether the first surface that a ray truly meets (`met`, camera metres; not finite: none) is the one that `pixel`
/// truly shows: not further from it than `footprints` times the longest side of the pixel's footprint on that surface,
/// which is depth / focal length / cosine towards the camera (the cosine at least 0.1). Depth and normal are true ones,
/// whatever maps SSRT reads.
bool is_real_hit(const LightView& view, int pixel, const Vec3& met, double footprints);

/// Eq. 6 with another constant, for rays that SSRT answers (pixel >= 0) and rays that it does not. Planar {3, count}.
std::vector<float> mixed_light(const std::vector<float>& in_view, const std::vector<float>& out_of_view,
                               const std::vector<float>& delta, const std::vector<int>& pixel, double constant);

}  // namespace clerestory
