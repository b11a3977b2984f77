#include "experiments/truth/truth_light.hpp"

#include <map>

#include "host/stopwatch.hpp"
#include "nets/scene_maps.hpp"
#include "tracer/random.hpp"

namespace clerestory {
namespace {

/// Fills chunks with the light of paths. The second pass adds emission to the very paths of the first.
class TrueLight {
 public:
  TrueLight(Device& device, TraceScene& traced, const Scene& maps, std::uint32_t seed)
      : device_(device), traced_(traced), maps_(maps), seed_(seed) {}

  void fill_reflected(const HostRays& rays) {
    const DenseRays dense = rays_of(rays);
    std::vector<float>& reflected = reflected_[rays.chunk.first_pixel];
    reflected = radiance(dense, reflected_light(seed_, rays));
    place_radiance(device_, rays, dense, reflected);
  }

  void fill_whole(const HostRays& rays) {
    const DenseRays dense = rays_of(rays);
    std::vector<float> light = radiance(dense, emitted_light());
    const std::vector<float>& reflected = reflected_.at(rays.chunk.first_pixel);
    for (std::size_t i = 0; i < light.size(); ++i) light[i] += reflected.at(i);
    place_radiance(device_, rays, dense, light);
  }

  double dropped() const { return dropped_; }

 private:
  DenseRays rays_of(const HostRays& rays) {
    DenseRays dense = dense_rays(device_, rays);
    leave_surface(dense, maps_.normal);
    return dense;
  }

  std::vector<float> radiance(const DenseRays& rays, const RadianceQuery& query) {
    return true_radiance(traced_, maps_.camera, rays, query, 1, dropped_);
  }

  Device& device_;
  TraceScene& traced_;
  const Scene& maps_;
  std::uint32_t seed_;
  std::map<int, std::vector<float>> reflected_;  // by a chunk's first pixel
  double dropped_ = 0;
};

}  // namespace

RadianceQuery reflected_light(std::uint32_t seed, const HostRays& rays) {
  RadianceQuery query;
  query.max_depth = kMaxDepth - 1, query.emitters = false;
  query.seed = Random(seed).seed(static_cast<std::uint64_t>(rays.chunk.first_pixel));
  return query;
}

RadianceQuery emitted_light() {
  RadianceQuery query;
  query.max_depth = 0;
  return query;
}

std::vector<float> true_radiance(TraceScene& traced, const Camera& camera, const DenseRays& rays, RadianceQuery query,
                                 double exposure, double& dropped) {
  if (rays.count() == 0) return {};
  query.to_world = camera.camera_to_world;
  DroppedSamples lost;
  std::vector<float> radiance = traced.radiance(rays.points, rays.directions, query, &lost);
  scale(radiance, static_cast<float>(exposure));
  dropped += static_cast<double>(lost.count);
  return radiance;
}

TruthRendering render_truth(Device& device, TraceScene& traced, const Scene& maps, const RenderSettings& settings) {
  RenderSpec spec = render_spec(settings);
  spec.trace = false;
  const std::map<std::string, Tensor> feeds = map_feeds(maps);
  TrueLight light(device, traced, maps, settings.seed);
  const Stopwatch watch;
  TruthRendering result;
  result.reflected = render_with_host_light(device, spec, feeds, settings.seed,
                                            [&](const HostRays& rays) { light.fill_reflected(rays); });
  result.whole =
      render_with_host_light(device, spec, feeds, settings.seed, [&](const HostRays& rays) { light.fill_whole(rays); });
  result.dropped = light.dropped();
  result.seconds = watch.seconds();
  return result;
}

}  // namespace clerestory
