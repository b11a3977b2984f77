#include "experiments/studies/linked_light.hpp"

#include <algorithm>
#include <chrono>
#include <map>

#include "experiments/studies/true_hits.hpp"
#include "nets/net_light.hpp"
#include "nets/scene_maps.hpp"
#include "tracer/random.hpp"

namespace clerestory {
namespace {

constexpr int kChunkRays = 1 << 16;

/// Adds the time of its life to a sum.
class Clock {
 public:
  explicit Clock(double& sum) : sum_(sum), start_(std::chrono::steady_clock::now()) {}
  ~Clock() { sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  double& sum_;
  std::chrono::steady_clock::time_point start_;
};

RenderSpec spec_of(const RenderSettings& settings) {
  RenderSpec spec = render_spec(settings);
  spec.trace = false, spec.chunk_rays = kChunkRays;
  return spec;
}

std::map<std::string, Tensor> feeds_of(const Scene& maps) {
  return {{"depth", tensor_of(maps.depth)},
          {"albedo", tensor_of(maps.albedo)},
          {"normal", tensor_of(maps.normal)},
          {"material", tensor_of(maps.material)},
          {"camera", camera_tensor(std::span(&maps.camera, 1))}};
}

Rays asked_rays(const DenseRays& dense, bool of_scene) {
  const std::size_t n = dense.count();
  Rays rays;
  rays.points.reserve(n), rays.directions.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    rays.points.emplace_back(dense.points[i], dense.points[n + i], dense.points[2 * n + i]);
    rays.directions.emplace_back(dense.directions[i], dense.directions[n + i], dense.directions[2 * n + i]);
  }
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

/// Along a ray a picture's path has one scattering less: the layer's own is the first.
std::vector<float> true_radiance(TraceScene& traced, double exposure, const DenseRays& rays, const Camera& camera,
                                 std::uint32_t seed, double& dropped) {
  if (rays.count() == 0) return {};
  RadianceQuery query;
  query.max_depth = kMaxDepth - 1, query.seed = seed, query.to_world = camera.camera_to_world;
  DroppedSamples lost;
  std::vector<float> radiance = traced.radiance(rays.points, rays.directions, query, &lost);
  for (float& v : radiance) v *= static_cast<float>(exposure);
  dropped += static_cast<double>(lost.count);
  return radiance;
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

/// Adds a picture whose light `radiance` gives, and sets the layer's own seconds.
template <class Radiance>
void render_once(Device& device, const ShadedSurface& surface, const RenderSettings& settings, LinkedPictures& result,
                 const Radiance& radiance) {
  double filling = 0, all = 0;
  HostRendered rendered;
  {
    const Clock clock(all);
    rendered = render_with_host_light(device, spec_of(settings), feeds_of(surface.maps), settings.seed,
                                      [&](const HostRays& rays) {
                                        const Clock inner(filling);
                                        const DenseRays dense = dense_rays(device, rays);
                                        place_radiance(device, rays, dense, radiance(rays, dense));
                                      });
  }
  result.seconds.layer = all - filling;
  result.radiance.push_back(image_of(rendered.radiance, surface.maps));
  result.shaded.clear();
  for (const double status : rendered.status.real) result.shaded.push_back(status == 0);
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
  State(Device d, const Scene& s, const RenderSettings& settings)
      : device(d),
        scene(s),
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

  Device device;
  Scene scene;
  SceneRadiance both, field, given;
  std::map<std::string, std::unique_ptr<SceneRadiance>> plain;
};

LinkedLight::LinkedLight(Device device, const Scene& scene, const RenderSettings& settings)
    : state_(std::make_unique<State>(std::move(device), scene, settings)) {}
LinkedLight::~LinkedLight() = default;

LinkedPictures LinkedLight::render(TraceScene& traced, double exposure, const ShadedSurface& surface,
                                   const RenderSettings& settings, const std::vector<Links>& choices) {
  State& s = *state_;
  LinkedPictures result;
  const auto answers_of = [&](const HostRays& rays, const DenseRays& dense) {
    LinkAnswers answers;
    const DenseRays truly = true_rays(dense, surface);
    const auto stream = static_cast<std::uint64_t>(rays.chunk.first_pixel);
    {
      const Clock clock(result.seconds.truth);
      answers.truth =
          true_radiance(traced, exposure, truly, surface.maps.camera,
                        static_cast<std::uint32_t>(Random(settings.seed).fork(stream).bits()), result.dropped);
    }
    s.answer(traced, dense, truly, surface, choices, answers, result.seconds);
    return answers;
  };

  std::map<int, LinkAnswers> known;  // by a chunk's first pixel: every choice sees the same rays
  for (const Links& links : choices)
    render_once(s.device, surface, settings, result, [&](const HostRays& rays, const DenseRays& dense) {
      const auto [entry, fresh] = known.try_emplace(rays.chunk.first_pixel);
      if (fresh) entry->second = answers_of(rays, dense);
      return linked_radiance(entry->second, links);
    });
  return result;
}

LinkedPictures LinkedLight::render_plain(const ShadedSurface& surface, const RenderSettings& settings) {
  State& s = *state_;
  std::unique_ptr<SceneRadiance>& light = s.plain[settings.light];
  if (!light) light = std::make_unique<SceneRadiance>(s.device, s.scene, settings, kChunkRays);
  LinkedPictures result;
  render_once(s.device, surface, settings, result, [&](const HostRays&, const DenseRays& dense) {
    const Clock clock(result.seconds.nets);
    return light->radiance(asked_rays(dense, surface.of_scene)).radiance;
  });
  return result;
}

}  // namespace clerestory
