#include "nets/render_scene.hpp"

#include <algorithm>
#include <cmath>

#include "host/cl/seconds_of.hpp"
#include "host/graph/plan.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/image_light.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/shade/render.hpp"
#include "nets/known_lamps.hpp"
#include "nets/scene_light.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {

Value photograph_radiance(Value photo, Value ambient, const SsrtHits& hits) {
  return image_light(photo, ambient, hits.pixel, hits.u);
}

std::array<double, 3> ambient_of(const Scene& scene) { return ambient_of(scene.photo, scene.material.plane(2)); }

std::array<double, 3> ambient_of(const Image& photo, const float* emits) {
  const std::size_t n = photo.pixels();
  std::array<double, 3> ambient{};
  double count = 0;
  for (std::size_t i = 0; i < n; ++i) count += emits[i] == 0;
  for (std::size_t c = 0; c < 3; ++c) {
    CompensatedSum sum;
    for (std::size_t i = 0; i < n; ++i)
      if (emits[i] == 0) sum.add(photo.data[c * n + i]);
    ambient[c] = count > 0 ? sum.value() / count : 0;
  }
  return ambient;
}

RenderSpec render_spec(const RenderSettings& settings, const SceneLight& light) {
  RenderSpec spec = render_spec(settings);
  spec.trace = light.traces || !settings.leave_out.contains(Saving::Tracing);
  spec.sampling.lobes = light.lamps || !settings.leave_out.contains(Saving::Lobes);
  spec.lamps = light.lamps_known;
  if (settings.chunk_rays == 0) spec.chunk_rays = light.chunk_rays;
  return spec;
}

namespace {

/// What u is measured in. Nets that mix by u were trained with one measure of it, and must be asked with the same.
DeltaDepth delta_of(const RenderSettings& settings) {
  const bool mixes = mixes_by_hits(settings.light) && settings.nets;
  const DeltaDepth trained = mixes ? settings.nets->sizes.delta : DeltaDepth::Linear;
  if (settings.delta.empty()) return trained;
  const DeltaDepth asked = delta_depth_of(settings.delta);
  if (mixes && asked != trained)
    throw usage_error("the light's nets mix by an uncertainty that is measured otherwise", "--delta", settings.delta,
                      fmt::format("{}, as {} were trained; or another --light", name_of(trained), settings.nets->note));
  return asked;
}

}  // namespace

RenderSpec render_spec(const RenderSettings& settings) {
  RenderSpec spec;
  spec.spp = settings.spp;
  spec.sampling.sampler = settings.sampler == kGuidedSampler ? Sampler::VndfCaps : sampler_of(settings.sampler);
  if (spec.sampling.sampler == Sampler::Grid8x16) spec.spp = 128;
  spec.sampling.points = points_of(settings.points);
  spec.sampling.brdf = brdf_model_of(settings.brdf);
  spec.ssrt.solver = ssrt_solver_of(settings.ssrt);
  spec.ssrt.delta = delta_of(settings);
  if (!(settings.thickness >= 0 && std::isfinite(settings.thickness)))
    throw usage_error("not a thickness", "--thickness", fmt::format("{}", settings.thickness),
                      "metres, 0 for surfaces without a back");
  spec.ssrt.thickness = settings.thickness;
  spec.every_chunk = settings.every_chunk;
  if (settings.chunk_rays > 0) spec.chunk_rays = settings.chunk_rays;
  if (spec.spp < 2)
    throw usage_error("a standard error needs two samples", "--spp", fmt::format("{}", spec.spp), "at least 2");
  return spec;
}

namespace {

/// Counts by name; a name may come several times.
std::vector<std::pair<std::string, double>> counted(Executor& executor, const RayCounts& counts) {
  using Sum = std::pair<std::string, double>;
  std::vector<Sum> sums;
  for (const auto& [name, value] : counts) {
    const double rays = static_cast<std::uint32_t>(executor.fetch(value).integer.at(0));
    const auto found = std::ranges::find(sums, name, &Sum::first);
    if (found == sums.end())
      sums.emplace_back(name, rays);
    else
      found->second += rays;
  }
  return sums;
}

/// Kernel times are collected while this lives.
class Profiled {
 public:
  Profiled(Device& device, bool on) : device_(device), on_(on) {
    if (on_) device_.set_profiling(true), device_.reset_profile();
  }
  ~Profiled() {
    try {
      if (on_) device_.set_profiling(false);
    } catch (const Error&) {  // the device has failed: whoever uses it is told, and here is perhaps told already
    }
  }
  std::vector<KernelProfile> kernels() { return on_ ? device_.profile() : std::vector<KernelProfile>{}; }

 private:
  Device& device_;
  bool on_;
};

}  // namespace

Rendering render_scene(Device& device, const Scene& scene, const RenderSettings& settings) {
  Graph graph;
  const SceneValues values = scene_values(graph, scene);
  const double rays = static_cast<double>(scene.photo.pixels()) * settings.spp;
  const SceneLight light = scene_light(graph, values, scene, settings, rays);
  const RenderSpec spec = render_spec(settings, light);
  const Rendered rendered =
      render(graph, spec, values.maps, values.camera, values.range,
             inputs_of(light, surface_points(values.maps.depth, values.camera)), builder_of(light));

  std::vector<Value> outputs{rendered.radiance, rendered.standard_error, rendered.uncertainty, rendered.status,
                             rendered.tally};
  for (const auto& [name, count] : rendered.counts) outputs.push_back(count);
  Executor executor(compile(graph, outputs, device, {.precision = settings.precision}), light.states);
  feed_scene(executor, scene);
  light.feed(executor);
  executor.after_chunk(settings.after_chunk);
  Profiled profiled(device, settings.profile);
  const double seconds = seconds_of(device, [&] { executor.run(settings.seed); });
  const RenderCounts counts = settings.every_chunk > 1
                                  ? RenderCounts{}  // most of them were never written
                                  : render_counts(executor.fetch(rendered.status), executor.fetch(rendered.tally));

  Rendering result;
  result.kernels = profiled.kernels();
  const auto image = [&](Value v) {
    Image picture(scene.width(), scene.height(), v.shape().c);
    picture.data = executor.fetch_floats(v);
    return picture;
  };
  result.radiance = image(rendered.radiance), result.standard_error = image(rendered.standard_error);
  result.uncertainty = image(rendered.uncertainty);
  result.rays = counts.directions, result.hits = counts.hits, result.dropped = counts.dropped;
  result.facing_away = counts.facing_away;
  result.answered = counted(executor, rendered.counts);
  result.seconds = seconds;
  result.explanation = executor.explain();
  result.shared_answers = light.shared_answers;
  if (const auto& first = counts.first_dropped)
    result.first_dropped = {static_cast<int>(first->pixel % scene.width()),
                            static_cast<int>(first->pixel / scene.width()), first->sample};
  return result;
}

}  // namespace clerestory
