// `light = truth`: the tracer answers for the radiance along the layer's rays.
#pragma once
#include "experiments/truth/host_rays.hpp"
#include "host/ops/shade/render.hpp"
#include "nets/render_scene.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// The layer's pictures under true light, in the tracer's units, at equal directions. Neither holds what the pixels
/// themselves emit.
struct TruthRendering {
  HostRendered reflected;  // emitters left out: a ray brings what the surface at its end reflects
  HostRendered whole;      // a ray that ends on an emitter brings its emission too
  double dropped = 0;      // paths that were not finite
  double seconds = 0;
};

/// One path along every ray. `maps` are seen by its camera in `traced`; settings.light is not asked.
/// A path ends after one scattering less than a picture of the tracer: the layer's own is the first.
TruthRendering render_truth(Device& device, TraceScene& traced, const Scene& maps, const RenderSettings& settings);

/// What surfaces at the ends of a chunk's rays reflect, by one path a ray. A picture's path has one scattering more:
/// the layer's own.
RadianceQuery reflected_light(std::uint32_t seed, const HostRays& rays);
/// What they emit.
RadianceQuery emitted_light();
/// What `query` brings along rays of a camera's space, times `exposure`; paths that were not finite add to `dropped`.
std::vector<float> true_radiance(TraceScene& traced, const Camera& camera, const DenseRays& rays, RadianceQuery query,
                                 double exposure, double& dropped);

}  // namespace clerestory
