#include "experiments/truth/linked_light.hpp"

#include <algorithm>
#include <map>

#include "experiments/truth/study_light.hpp"
#include "experiments/truth/true_hits.hpp"
#include "experiments/truth/truth_light.hpp"
#include "host/stopwatch.hpp"
#include "nets/learned_light.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

constexpr int kChunkRays = 1 << 16;
constexpr std::uint32_t kEmissionStream = 0x6c616d70u;  // parts its random numbers from the first pass's

/// Adds the time of its life to a sum.
class Clock {
 public:
  explicit Clock(double& sum) : sum_(sum) {}
  ~Clock() { sum_ += watch_.seconds(); }

 private:
  double& sum_;
  Stopwatch watch_;
};

RenderSpec spec_of(const RenderSettings& settings) {
  RenderSpec spec = render_spec(settings);
  spec.trace = false, spec.chunk_rays = kChunkRays;
  spec.sampling.lobes = true;  // lamps of a plain light ask
  return spec;
}

Rays asked_rays(const DenseRays& dense, bool of_scene) {
  const std::size_t n = dense.count();
  Rays rays;
  rays.points.reserve(n), rays.directions.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    rays.points.emplace_back(dense.points[i], dense.points[n + i], dense.points[2 * n + i]);
    rays.directions.emplace_back(dense.directions[i], dense.directions[n + i], dense.directions[2 * n + i]);
  }
  rays.lobes = dense.lobes;
  if (of_scene) rays.skip = dense.pixel;
  return rays;
}

/// The same rays from where their pixels truly are, as the tracer starts them.
DenseRays true_rays(const DenseRays& dense, const ShadedSurface& surface) {
  DenseRays rays = dense;
  const Camera& camera = surface.maps.camera;
  for (std::size_t i = 0; i < rays.count(); ++i) {
    const int pixel = rays.pixel[i];
    const Vec3 p = camera.unproject(pixel % camera.width + 0.5, pixel / camera.width + 0.5,
                                    surface.depth.data[static_cast<std::size_t>(pixel)]);
    for (std::size_t c = 0; c < 3; ++c) rays.points[c * rays.count() + i] = static_cast<float>(p[static_cast<int>(c)]);
  }
  leave_surface(rays, surface.normal);
  return rays;
}

/// Those rays of a chunk that end on an emitter. Nets say nothing of them here: their part is in the first pass.
struct EmittedLight {
  DenseRays rays;
  LinkAnswers answers;
};
EmittedLight those_that_shine(const DenseRays& rays, const std::vector<float>& radiance) {
  const std::size_t n = rays.count();
  std::vector<std::size_t> bright;
  for (std::size_t i = 0; i < n; ++i)
    if (radiance[i] > 0 || radiance[n + i] > 0 || radiance[2 * n + i] > 0) bright.push_back(i);
  EmittedLight light;
  for (const std::size_t i : bright) {
    light.rays.at.push_back(rays.at[i]), light.rays.pixel.push_back(rays.pixel[i]);
  }
  for (std::size_t c = 0; c < 3; ++c)
    for (const std::size_t i : bright) {
      light.rays.points.push_back(rays.points[c * n + i]), light.rays.directions.push_back(rays.directions[c * n + i]);
      light.answers.truth.push_back(radiance[c * n + i]);
    }
  const std::vector<float> nothing(3 * bright.size(), 0);
  light.answers.mixed = light.answers.far = light.answers.at_true_hits = nothing;
  return light;
}

void add(Image& to, const Image& what, float factor) {
  for (std::size_t i = 0; i < to.data.size(); ++i) to.data[i] += factor * what.data[i];
}

RenderSettings with_light(RenderSettings settings, const std::string& light) {
  settings.light = light;
  return settings;
}

Image image_of(const Tensor& radiance, const Scene& maps) {
  Image image(maps.width(), maps.height(), 3);
  image.data = radiance.floats();
  return image;
}

/// The layer's picture of rays that `fill` answers, and the layer's own seconds without it.
template <class Fill>
HostRendered render_filled(Device& device, const ShadedSurface& surface, const RenderSettings& settings,
                           double& layer_seconds, const Fill& fill) {
  double filling = 0, all = 0;
  HostRendered rendered;
  {
    const Clock clock(all);
    rendered = render_with_host_light(device, spec_of(settings), map_feeds(surface.maps), settings.seed,
                                      [&](const HostRays& rays) {
                                        const Clock inner(filling);
                                        fill(rays);
                                      });
  }
  layer_seconds = all - filling;
  return rendered;
}

std::vector<bool> shaded_pixels(const Tensor& status) {
  std::vector<bool> shaded;
  for (const double value : status.real) shaded.push_back(value == 0);
  return shaded;
}

}  // namespace

std::vector<float> linked_radiance(const LinkAnswers& a, const Links& links) {
  if (links.all_light()) return a.truth;
  if (links == Links{}) return a.mixed;
  const std::size_t count = a.truth.size() / 3;
  std::vector<float> radiance(3 * count);
  for (std::size_t at = 0; at < 3 * count; ++at) {
    const std::size_t i = at % count;
    if (links.hits) {
      const bool told = a.true_pixel[i] >= 0 ? links.in_view : links.out_of_view;
      radiance[at] = told ? a.truth[at] : a.at_true_hits[at];
      continue;
    }
    const float u = a.u[i], far = u > static_cast<float>(kLeastShare) ? u * a.far[at] : 0;  // as the net mixes
    radiance[at] = links.in_view ? (1 - u) * a.truth[at] + far : a.mixed[at] - far + u * a.truth[at];
  }
  return radiance;
}

double LinkSeconds::of(const Links& links) const {
  const bool net = !links.all_light(), ask_hits = links.hits && !links.all_light();
  return layer + (net ? nets : 0) + (ask_hits ? hits : 0) + (links.in_view || links.out_of_view ? truth : 0);
}

struct LinkedLight::State {
  State(Device d, const Scene& s, const RenderSettings& given_settings)
      : device(d),
        scene(s),
        settings(given_settings),
        both(d, s, with_light(settings, "net"), kChunkRays),
        field(d, s, with_light(settings, "out_of_view"), kChunkRays),
        given(d, s, with_light(settings, "net"), kChunkRays, RayHits::Given) {}

  /// What any of the choices asks of the nets and of the true hits.
  void answer(TraceScene& traced, const DenseRays& dense, const DenseRays& truly, const ShadedSurface& surface,
              const std::vector<Links>& choices, LinkAnswers& answers, LinkSeconds& seconds) {
    const auto any = [&](const auto& asks) { return std::any_of(choices.begin(), choices.end(), asks); };
    Rays rays = asked_rays(dense, surface.of_scene);
    if (any([](const Links& l) { return !l.all_light() && !l.hits; })) {
      const Clock clock(seconds.nets);
      RadianceAnswers mixed = both.radiance(rays);
      answers.mixed = std::move(mixed.radiance), answers.u = std::move(mixed.uncertainty);
    }
    if (any([](const Links& l) { return !l.hits && l.in_view != l.out_of_view; }))
      answers.far = field.radiance(rays).radiance;
    if (!any([](const Links& l) { return !l.all_light() && l.hits; })) return;
    {
      const Clock clock(seconds.hits);
      answers.true_pixel = true_hits(traced, surface.maps.camera, truly.points, truly.directions);
    }
    rays.hits = answers.true_pixel;
    answers.at_true_hits = given.radiance(rays).radiance;
  }

  SceneRadiance& plain_light(const std::string& name) {
    std::unique_ptr<SceneRadiance>& light = plain[name];
    if (!light)
      light = std::make_unique<SceneRadiance>(device, scene, under_light(settings, name, device, scene), kChunkRays);
    return *light;
  }

  /// What rays of a chunk that end on an emitter bring, and whether they are said to hit.
  EmittedLight emission(TraceScene& traced, double exposure, const HostRays& rays, const ShadedSurface& surface,
                        bool ask_hits, double& dropped) {
    const DenseRays dense = dense_rays(device, rays), truly = true_rays(dense, surface);
    const Camera& camera = surface.maps.camera;
    const std::vector<float> radiance = true_radiance(traced, camera, truly, emitted_light(), exposure, dropped);
    EmittedLight light = those_that_shine(dense, radiance);
    if (!ask_hits || light.rays.count() == 0) return light;
    const EmittedLight there = those_that_shine(truly, radiance);
    light.answers.true_pixel = true_hits(traced, camera, there.rays.points, there.rays.directions);
    light.answers.u = plain_light("image").radiance(asked_rays(light.rays, surface.of_scene)).uncertainty;
    return light;
  }

  Device device;
  Scene scene;
  RenderSettings settings;
  SceneRadiance both, field, given;
  std::map<std::string, std::unique_ptr<SceneRadiance>> plain;
};

LinkedLight::LinkedLight(Device device, const Scene& scene, const RenderSettings& settings)
    : state_(std::make_unique<State>(std::move(device), scene, settings)) {}
LinkedLight::~LinkedLight() = default;

LinkedPictures LinkedLight::render(TraceScene& traced, double exposure, const ShadedSurface& surface,
                                   const RenderSettings& settings, const std::vector<Links>& choices,
                                   int emission_spp) {
  LinkedPictures result = render_reflected(traced, exposure, surface, settings, choices);
  add_emission(traced, exposure, surface, settings, choices, emission_spp, result);
  return result;
}

LinkedPictures LinkedLight::render_reflected(TraceScene& traced, double exposure, const ShadedSurface& surface,
                                             const RenderSettings& settings, const std::vector<Links>& choices) {
  State& s = *state_;
  LinkedPictures result;
  const auto answers_of = [&](const HostRays& rays, const DenseRays& dense) {
    LinkAnswers answers;
    const DenseRays truly = true_rays(dense, surface);
    {
      const Clock clock(result.seconds.truth);
      answers.truth = true_radiance(traced, surface.maps.camera, truly, reflected_light(settings.seed, rays), exposure,
                                    result.dropped);
    }
    s.answer(traced, dense, truly, surface, choices, answers, result.seconds);
    return answers;
  };

  std::map<int, LinkAnswers> known;  // by a chunk's first pixel: every choice sees the same rays
  for (const Links& links : choices) {
    const HostRendered rendered =
        render_filled(s.device, surface, settings, result.seconds.layer, [&](const HostRays& rays) {
          const DenseRays dense = dense_rays(s.device, rays);
          const auto [entry, fresh] = known.try_emplace(rays.chunk.first_pixel);
          if (fresh) entry->second = answers_of(rays, dense);
          place_radiance(s.device, rays, dense, linked_radiance(entry->second, links));
        });
    result.radiance.push_back(image_of(rendered.radiance, surface.maps));
    result.shaded = shaded_pixels(rendered.status);
  }
  return result;
}

void LinkedLight::add_emission(TraceScene& traced, double exposure, const ShadedSurface& surface,
                               const RenderSettings& given, const std::vector<Links>& choices, int spp,
                               LinkedPictures& result) {
  State& s = *state_;
  RenderSettings settings = given;
  settings.spp = spp, settings.seed = given.seed ^ kEmissionStream;
  const bool ask_hits =
      std::any_of(choices.begin(), choices.end(), [](const Links& l) { return l.in_view != l.out_of_view; });
  std::map<int, EmittedLight> known;
  std::vector<std::pair<Links, Image>> made;
  const auto picture = [&](const Links& links) -> const Image& {
    for (const auto& [have, image] : made)
      if (have == links) return image;
    double layer = 0;
    const HostRendered rendered = render_filled(s.device, surface, settings, layer, [&](const HostRays& rays) {
      const auto [entry, fresh] = known.try_emplace(rays.chunk.first_pixel);
      if (fresh) entry->second = s.emission(traced, exposure, rays, surface, ask_hits, result.dropped);
      place_radiance(s.device, rays, entry->second.rays, linked_radiance(entry->second.answers, links));
    });
    return made.emplace_back(links, image_of(rendered.radiance, surface.maps)).second;
  };
  const Clock clock(result.seconds.truth);
  for (std::size_t k = 0; k < choices.size(); ++k) {
    const Links& links = choices[k];
    if (links.out_of_view) add(result.radiance[k], picture({true, true, true}), 1);
    if (links.in_view != links.out_of_view)  // from out of view comes the rest
      add(result.radiance[k], picture({links.hits, true, false}), links.in_view ? 1.0f : -1.0f);
  }
}

LinkedPictures LinkedLight::render_plain(const ShadedSurface& surface, const std::string& name,
                                         const RenderSettings& settings) {
  State& s = *state_;
  SceneRadiance& light = s.plain_light(name);
  LinkedPictures result;
  const HostRendered rendered =
      render_filled(s.device, surface, settings, result.seconds.layer, [&](const HostRays& rays) {
        const Clock clock(result.seconds.nets);
        const DenseRays dense = dense_rays(s.device, rays);
        place_radiance(s.device, rays, dense, light.radiance(asked_rays(dense, surface.of_scene)).radiance);
      });
  result.radiance.push_back(image_of(rendered.radiance, surface.maps));
  result.shaded = shaded_pixels(rendered.status);
  return result;
}

}  // namespace clerestory
