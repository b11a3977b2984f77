#include "experiments/studies/truth_light.hpp"

#include <chrono>
#include <map>

#include "nets/scene_maps.hpp"
#include "tracer/random.hpp"

namespace clerestory {
namespace {

std::vector<float> values_of(Device& device, const TensorView& view) {
  std::vector<float> values(static_cast<std::size_t>(view.shape.count()));
  device.read(view.buffer, values.data(), values.size() * sizeof(float), view.offset * sizeof(float));
  return values;
}

/// A chunk's rays without its gaps, as the tracer takes them: planar {3, count}. `at`: where ray i lies in the chunk.
struct DenseRays {
  std::vector<std::size_t> at;
  std::vector<float> points, directions;
};

/// Queries ignore what is nearer than kRayOffset; the tracer's own rays start that far off the surface. Origins are
/// moved so that both begin at one place: in a corner narrower than that they would meet other walls.
DenseRays dense_rays(Device& device, const HostRays& rays, const Image& normal) {
  const std::vector<float> points = values_of(device, rays.points), directions = values_of(device, rays.direction);
  const auto pixels = static_cast<std::size_t>(rays.points.shape.plane());
  const auto plane = static_cast<std::size_t>(rays.direction.shape.plane());
  DenseRays dense;
  for (int p = 0; p < rays.chunk.pixels; ++p)
    for (int s = 0; s < rays.chunk.samples; ++s) {
      const std::size_t i = static_cast<std::size_t>(p) * rays.sample_capacity + s;
      if (directions[i] != 0 || directions[plane + i] != 0 || directions[2 * plane + i] != 0) dense.at.push_back(i);
    }
  for (std::size_t c = 0; c < 3; ++c)
    for (const std::size_t i : dense.at) {
      const std::size_t pixel = static_cast<std::size_t>(rays.chunk.first_pixel) + i / rays.sample_capacity;
      const float away = kRayOffset * (normal.data[c * pixels + pixel] - directions[c * plane + i]);
      dense.points.push_back(points[c * pixels + pixel] + away);
      dense.directions.push_back(directions[c * plane + i]);
    }
  return dense;
}

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
    const DenseRays dense = dense_rays(device_, rays, maps_.normal);
    std::vector<float>& reflected = reflected_[rays.chunk.first_pixel];
    reflected = radiance(dense, paths_);
    place(dense, reflected, rays.radiance);
  }

  void fill_whole(const HostRays& rays) {
    const DenseRays dense = dense_rays(device_, rays, maps_.normal);
    std::vector<float> light = radiance(dense, emission_);
    const std::vector<float>& reflected = reflected_.at(rays.chunk.first_pixel);
    for (std::size_t i = 0; i < light.size(); ++i) light[i] += reflected.at(i);
    place(dense, light, rays.radiance);
  }

  double dropped() const { return dropped_; }

 private:
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

  void place(const DenseRays& rays, const std::vector<float>& light, const TensorView& to) {
    std::vector<float> values(static_cast<std::size_t>(to.shape.count()), 0);
    const auto plane = static_cast<std::size_t>(to.shape.plane());
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < rays.at.size(); ++i) values[c * plane + rays.at[i]] = light[c * rays.at.size() + i];
    device_.write(to.buffer, values.data(), values.size() * sizeof(float), to.offset * sizeof(float));
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
  const auto start = std::chrono::steady_clock::now();
  TruthRendering result;
  result.reflected = render_with_host_light(device, spec, feeds, settings.seed,
                                            [&](const HostRays& rays) { light.fill_reflected(rays); });
  result.whole =
      render_with_host_light(device, spec, feeds, settings.seed, [&](const HostRays& rays) { light.fill_whole(rays); });
  result.dropped = light.dropped();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace clerestory
