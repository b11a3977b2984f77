#include "nets/render_scene.hpp"

#include <algorithm>
#include <chrono>

#include "host/graph/plan.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/image_light.hpp"
#include "host/ops/light/mix_light.hpp"
#include "host/ops/shade/render.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {

LightBuilder light_named(const std::string& name) {
  if (name == "image")
    return [](Graph&, const RayBatch& rays, std::span<const Value> in) {
      return photograph_radiance(in[0], in[1], rays.hits);
    };
  if (name == "constant") return constant_light_builder();
  if (name == "panorama") return panorama_light_builder();
  throw usage_error("there is no such light", "--light", name, "image, constant or panorama");
}

std::vector<Value> light_inputs(const SceneValues& values, const std::string& light) {
  return light == "constant" ? std::vector{values.ambient} : std::vector{values.photo, values.ambient};
}

Value photograph_radiance(Value photo, Value ambient, const SsrtHits& hits) {
  return mix_light(image_light(photo, ambient, hits.pixel), constant_light(ambient, hits.u, photo), hits.u);
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

RenderSpec render_spec(const RenderSettings& settings) {
  RenderSpec spec;
  spec.spp = settings.spp;
  spec.sampling.sampler = sampler_of(settings.sampler);
  if (spec.sampling.sampler == Sampler::Grid8x16) spec.spp = 128;
  spec.sampling.points = points_of(settings.points);
  spec.sampling.brdf = brdf_model_of(settings.brdf);
  spec.ssrt.solver = ssrt_solver_of(settings.ssrt);
  spec.ssrt.delta = delta_depth_of(settings.delta);
  spec.trace = settings.light == "image";
  if (spec.spp < 2)
    throw usage_error("a standard error needs two samples", "--spp", fmt::format("{}", spec.spp), "at least 2");
  return spec;
}

Rendering render_scene(Device& device, const Scene& scene, const RenderSettings& settings) {
  const RenderSpec spec = render_spec(settings);
  Graph graph;
  const SceneValues values = scene_values(graph, scene);
  const Rendered rendered = render(graph, spec, values.maps, values.camera, values.range,
                                   light_inputs(values, settings.light), light_named(settings.light));

  Executor executor(compile(
      graph, {rendered.radiance, rendered.standard_error, rendered.uncertainty, rendered.status, rendered.tally},
      device));
  feed_scene(executor, scene);
  device.finish();
  const auto start = std::chrono::steady_clock::now();
  executor.run(settings.seed);
  device.finish();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  const RenderCounts counts = render_counts(executor.fetch(rendered.status), executor.fetch(rendered.tally));

  Rendering result;
  const auto image = [&](Value v) {
    Image picture(scene.width(), scene.height(), v.shape().c);
    picture.data = executor.fetch_floats(v);
    return picture;
  };
  result.radiance = image(rendered.radiance), result.standard_error = image(rendered.standard_error);
  result.uncertainty = image(rendered.uncertainty);
  result.rays = counts.directions, result.hits = counts.hits, result.dropped = counts.dropped;
  result.facing_away = counts.facing_away;
  result.seconds = elapsed.count();
  result.bytes = executor.bytes();
  result.explanation = executor.explain();
  result.left_out = graph.what_was_left_out();
  if (counts.first_dropped)
    result.first_dropped =
        fmt::format("pixel {},{}, sample {}, seed {}", counts.first_dropped->pixel % scene.width(),
                    counts.first_dropped->pixel / scene.width(), counts.first_dropped->sample, settings.seed);
  return result;
}

}  // namespace clerestory
