// What screen-space tracing guesses, as the tracer knows it: whether a ray ends on a surface that the picture shows.
#pragma once
#include <vector>

#include "host/math/camera.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// The pixel y * w + x that shows the first surface on each ray; -1 where a ray meets nothing, or what lies beside the
/// picture or hidden from the camera. Rays: planar {3, count}, camera space; what is nearer than kRayOffset is not met.
std::vector<int> true_hits(TraceScene& traced, const Camera& camera, const std::vector<float>& points,
                           const std::vector<float>& directions);

}  // namespace clerestory
