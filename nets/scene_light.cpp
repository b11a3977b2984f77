#include "nets/scene_light.hpp"

#include <algorithm>

#include "host/graph/map_chunks.hpp"
#include "host/ops/light/image_light.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "nets/known_lamps.hpp"
#include "nets/learned_light.hpp"

namespace clerestory {
namespace {

using Asked = std::span<const Value>;

SceneLight without_nets(std::vector<Value> inputs, bool traces,
                        std::function<Value(const AskedRays&, Asked)> radiance) {
  SceneLight light;
  light.inputs = std::move(inputs);
  light.traces = traces;
  light.radiance = [radiance](const AskedRays& rays, Asked in, RayCounts*) { return radiance(rays, in); };
  light.feed = [](Executor&) {};
  return light;
}

void check_name(const std::string& name) {
  const std::vector<std::string>& known = light_names();
  if (std::find(known.begin(), known.end(), name) == known.end())
    throw usage_error("there is no such light", "--light", name, fmt::format("{}", fmt::join(known, ", ")));
}

SceneLight named_light(Graph& graph, const SceneValues& v, const Scene& scene, const RenderSettings& settings,
                       double rays_to_come) {
  if (is_learned_light(settings.light)) {
    if (!settings.nets)
      throw usage_error("learned light without its weights", "--light", settings.light, "--light-weights DIR");
    check_method(settings.light, settings.nets->sizes, settings.nets->note);
    if (settings.light == "li2020") return li2020_scene_light(graph, scene, v, settings);
    return learned_light(graph, v, scene, settings, rays_to_come);
  }
  const auto given = [&](const std::array<double, 3>& radiance) {
    return graph.constant(Tensor({1, 3, 1, 1}, std::vector<double>(radiance.begin(), radiance.end())));
  };
  if (settings.light == "constant")  // the photograph only says how large a picture is
    return without_nets({v.photo, settings.constant ? given(*settings.constant) : v.ambient}, false,
                        [](const AskedRays& rays, Asked in) { return constant_light(in[1], rays.direction, in[0]); });
  const auto leveled = [&](Value light) {
    return settings.level ? multiply(light, expand(given(*settings.level), light.shape())) : light;
  };
  const std::vector<Value> photograph{leveled(v.photo), leveled(v.ambient)};
  if (settings.light == "image")
    return without_nets(photograph, true,
                        [](const AskedRays& rays, Asked in) { return photograph_radiance(in[0], in[1], rays.hits); });
  const auto distant = settings.light == "mirrored" ? mirrored_light : panorama_light;
  return without_nets(photograph, false, [distant](const AskedRays& rays, Asked in) {
    return distant(in[0], in[1], rays.camera, rays.direction);
  });
}

}  // namespace

const std::vector<std::string>& light_names() {
  static const std::vector<std::string> names{"image", "constant",  "panorama",    "mirrored",
                                              "net",   "completed", "out_of_view", "li2020"};
  return names;
}

bool is_learned_light(const std::string& name) {
  check_name(name);
  return mixes_by_hits(name) || name == "out_of_view" || name == "li2020";
}

bool mixes_by_hits(const std::string& name) { return name == "net" || name == "completed"; }

bool traces_into_photograph(const std::string& name) { return name == "image" || mixes_by_hits(name); }

std::string light_of(const LightSizes& sizes) { return sizes.li2020 ? "li2020" : "net"; }

bool nets_fit(const std::string& light, const LightSizes& sizes) {
  return !is_learned_light(light) || (light == "li2020") == sizes.li2020.has_value();
}

void check_method(const std::string& light, const LightSizes& sizes, const std::string& note) {
  if (nets_fit(light, sizes)) return;
  const bool theirs = sizes.li2020.has_value();
  throw usage_error("weights of another method", note,
                    theirs ? "the light's net of Li et al. 2020" : "LightNet and the net out of view",
                    theirs ? "--light li2020" : "a training of light.net = li2020, or --light net");
}

SceneLight scene_light(Graph& graph, const SceneValues& v, const Scene& scene, const RenderSettings& settings,
                       double rays_to_come) {
  check_name(settings.light);
  SceneLight light = with_lamps(graph, named_light(graph, v, scene, settings, rays_to_come), settings.lamps);
  if (settings.sampler == kGuidedSampler)
    if (const std::optional<Tensor> known = known_lamps(scene, settings)) light.lamps_known = graph.constant(*known);
  return light;
}

std::vector<Value> inputs_of(const SceneLight& light, Value points) {
  std::vector<Value> inputs = light.inputs;
  inputs.push_back(points);
  return inputs;
}

LightBuilder builder_of(const SceneLight& light) {
  return [radiance = light.radiance](Graph&, const RayBatch& rays, std::span<const Value> in) {
    const Value points = points_of_chunk(in.back(), rays.direction);
    return radiance({points, rays.direction, rays.lobes, rays.hits, rays.camera}, in.first(in.size() - 1), rays.counts);
  };
}

Value points_of_chunk(Value whole, Value direction) { return take_pixels(whole, direction.shape().h); }

}  // namespace clerestory
