#include "experiments/truth/truth_light.hpp"

#include <map>

#include "experiments/truth/host_rays.hpp"
#include "host/stopwatch.hpp"
#include "nets/scene_maps.hpp"
#include "tracer/random.hpp"

namespace clerestory {
namespace {

/// Fills chunks with the light of paths. The second pass adds emission to the very paths of the first.
class TrueLight {
 public:
  TrueLight(Device& device, TraceScene& traced, const Scene& maps, std::uint32_t seed)
      : device_(device), traced_(traced), maps_(maps), seed_(seed) {
    paths_.max_depth = kMaxDepth - 1, paths_.emitters = false;
    emission_.max_depth = 0;
    paths_.to_world = emission_.to_world = maps.camera.camera_to_world;
  }

  void fill_reflected(const HostRays& rays) {
    paths_.seed =
        static_cast<std::uint32_t>(Random(seed_).fork(static_cast<std::uint64_t>(rays.chunk.first_pixel)).bits());
    const DenseRays dense = rays_of(rays);
    std::vector<float>& reflected = reflected_[rays.chunk.first_pixel];
    reflected = radiance(dense, paths_);
    place_radiance(device_, rays, dense, reflected);
  }

  void fill_whole(const HostRays& rays) {
    const DenseRays dense = rays_of(rays);
    std::vector<float> light = radiance(dense, emission_);
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
    std::vector<float> light(rays.points.size());
    if (light.empty()) return light;
    const std::size_t bytes = light.size() * sizeof(float);
    const Buffer points = device_.allocate(bytes), directions = device_.allocate(bytes), out = device_.allocate(bytes);
    device_.write(points, rays.points.data(), bytes);
    device_.write(directions, rays.directions.data(), bytes);
    const int count = static_cast<int>(rays.at.size());
    DroppedSamples dropped;
    traced_.radiance(points, directions, out, count, count, query, &dropped);
    dropped_ += static_cast<double>(dropped.count);
    device_.read(out, light.data(), bytes);
    return light;
  }

  Device& device_;
  TraceScene& traced_;
  const Scene& maps_;
  std::uint32_t seed_;
  RadianceQuery paths_, emission_;
  std::map<int, std::vector<float>> reflected_;  // by a chunk's first pixel
  double dropped_ = 0;
};

}  // namespace

TruthRendering render_truth(Device& device, TraceScene& traced, const Scene& maps, const RenderSettings& settings) {
  RenderSpec spec = render_spec(settings);
  spec.trace = false;
  const std::map<std::string, Tensor> feeds{{"depth", tensor_of(maps.depth)},
                                            {"albedo", tensor_of(maps.albedo)},
                                            {"normal", tensor_of(maps.normal)},
                                            {"material", tensor_of(maps.material)},
                                            {"camera", camera_tensor(std::span(&maps.camera, 1))}};
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
