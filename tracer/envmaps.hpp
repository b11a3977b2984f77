// Environment maps at the surface points of a view: the light that falls on what a camera sees.
#pragma once
#include "host/io/light_files.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// Radiance that arrives at the pixel of each tile along envmap_direction, unscaled; `maps` are scene.maps(camera) of
/// `world`. Rays begin where the tracer's own paths leave that surface. All samples of a texel run along one direction:
/// they differ in how they scatter from what they meet. Textures are averaged over a pixel's angle, as in the picture
/// that a network takes the light from. Zeros where a pixel has no surface. query.to_world and query.spread are not
/// read.
Envmaps trace_envmaps(TraceScene& scene, const World& world, const Camera& camera, const TraceMaps& maps,
                      const RadianceQuery& query, DroppedSamples* dropped = nullptr);

}  // namespace clerestory
