// One chunk's rays of a layer whose light is not a graph, as lists without gaps: for those who ask the tracer.
#pragma once
#include <vector>

#include "host/io/image.hpp"
#include "host/ops/shade/render.hpp"
#include "nets/scene_radiance.hpp"

namespace clerestory {

/// Rays of a chunk, planar {3, count} in camera space. at[i]: where ray i lies in the chunk.
struct DenseRays {
  std::vector<std::size_t> at;
  std::vector<int> pixel;  // of the picture, that ray i starts from
  std::vector<float> points, directions;
  RayLobes lobes;  // empty unless the layer's sampling has them

  std::size_t count() const { return at.size(); }
};
DenseRays dense_rays(Device& device, const HostRays& rays);

/// The tracer's queries ignore what is nearer than kRayOffset, and its own rays start that far off the surface. Origins
/// are moved so that both begin at one place: in a corner narrower than that they would meet other walls.
void leave_surface(DenseRays& rays, const Image& normal);

/// Fills the chunk's radiance, {3, count} planar; rays that are none bring 0.
void place_radiance(Device& device, const HostRays& rays, const DenseRays& dense, const std::vector<float>& radiance);

}  // namespace clerestory
