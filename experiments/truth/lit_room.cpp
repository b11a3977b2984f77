#include "experiments/truth/lit_room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "experiments/applications/predict.hpp"
#include "experiments/truth/traced_room.hpp"
#include "experiments/weights/shipped.hpp"
#include "host/math/panorama.hpp"
#include "host/math/statistics.hpp"
#include "tracer/probes.hpp"

namespace clerestory {
namespace {

constexpr int kPilotSpp = 4;
/// Streams of a view's random numbers.
enum Stream : std::uint64_t { kPicture = 1, kPilot, kProbes, kDraws };

/// True maps in the files' form.
LightView view_of(const TraceMaps& maps, const Camera& camera) {
  Scene scene = scene_of(maps, camera);
  LightView view;
  view.camera = camera;
  view.emission = Image(camera.width, camera.height, 1);
  std::copy_n(scene.material.plane(2), view.emission.pixels(), view.emission.plane(0));
  view.albedo = std::move(scene.albedo), view.normal = std::move(scene.normal), view.depth = std::move(scene.depth);
  view.material = std::move(scene.material);
  view.true_normal = view.normal, view.true_depth = view.depth;
  view.envmaps.layout = EnvmapLayout::of(camera.width, camera.height);
  // Rays are traced one by one once they are drawn.
  view.envmaps.radiance = Image(view.envmaps.layout.file_width(), view.envmaps.layout.file_height(), 3);
  return view;
}

/// What the shipped MGNet says of the picture instead. Only a picture that is clipped has a white to know lamps by.
std::string predict(Device& device, LightView& view, const std::filesystem::path& weights, bool clipped) {
  Prediction p = predict_maps(device, weights_or_shipped(weights), view.image, {});
  const std::string note = p.note;
  const double metres = p.scene_scale / scene_scale(p.depth.data, "predicted depth");  // no scale from the truth
  see_predicted(view, {std::move(p.albedo), std::move(p.normal), std::move(p.depth), std::move(p.material)}, metres);
  view.emission = clipped ? emission_flags(view.image) : Image(view.camera.width, view.camera.height, 1);
  std::ranges::copy(view.emission.data, view.material.plane(2));
  return note;
}

}  // namespace

LitRoomOptions lit_room_options(const Config& c) {
  LitRoomOptions o;
  o.width = c.whole("data.width"), o.height = c.whole("data.height"), o.spp = c.whole("data.spp");
  o.views = c.whole("incident.views"), o.clamp = c.real("incident.clamp"), o.seeds = c.whole("study.seeds");
  o.rows = c.whole("incident.points"), o.samples = c.whole("incident.directions"),
  o.ray_spp = c.whole("incident.ray_spp");
  o.probes = c.whole("incident.probes"), o.probe_spp = c.whole("incident.probe_spp");
  o.maps_weights = c.text("maps.weights"), o.predicted = c.text("data.maps") == "predicted",
  o.clipped = c.flag("incident.clipped_picture");
  if (o.samples % 16 != 0)
    throw usage_error("not a multiple of 16", "incident.directions", std::to_string(o.samples), "16, 32, ... 128");
  return o;
}

LitRoom::LitRoom(const Device& device, const ListedRoom& listed, const LitRoomOptions& options)
    : device_(device),
      options_(options),
      seed_(listed.seed),
      room_(listed.make()),
      traced_(device, room_.scene),
      cameras_(listed.cameras(traced_, room_, options.views, options.width, options.height)) {}

/// The bound on indirect light is stated against white, so a few samples find the exposure first.
float LitRoom::most_indirect(const Camera& camera, const Random& random) {
  if (options_.clamp <= 0) return std::numeric_limits<float>::infinity();
  const TracePicture pilot = traced_.picture(camera, kPilotSpp, random.seed(kPilot));
  return static_cast<float>(options_.clamp / exposure_of(pilot.mean.data));
}

void LitRoom::add_probes(KnownView& known, const TraceMaps& maps, const RadianceQuery& query, float exposure,
                         Random random) {
  std::vector<Probe>& probes = known.view.probes;
  probes = place_probes(traced_, room_.scene, known.view.camera, maps, options_.probes, random.fork(0));
  RadianceQuery half = query;
  half.spp = options_.probe_spp;
  for (Probe& probe : probes) {
    const auto first = static_cast<std::uint32_t>(random.bits()), second = static_cast<std::uint32_t>(random.bits());
    Image& noise =
        known.noise.emplace_back(trace_probe_twice(traced_, known.view.camera, probe, half, {first, second}));
    scale(probe.radiance.data, exposure), scale(noise.data, exposure * exposure);
  }
}

void LitRoom::trace_draw(const LightView& view, LightRays& rays, const RadianceQuery& query, float exposure) {
  std::vector<std::size_t> own;  // those from surfaces; a probe's have their light from its panorama
  for (std::size_t i = 0; i < rays.skip.size(); ++i)
    if (rays.skip[i] >= 0) own.push_back(i);
  const std::size_t n = own.size();
  std::vector<Vec3> points(n), directions(n);
  for (std::size_t k = 0; k < n; ++k)
    points[k] = true_start(view, rays, own[k]), directions[k] = rays.directions[own[k]];
  RadianceQuery from_camera = query;
  from_camera.spp = options_.ray_spp, from_camera.to_world = view.camera.camera_to_world;
  from_camera.spread = static_cast<float>(1 / std::sqrt(view.camera.fx * view.camera.fy));
  const std::vector<float> light = traced_.radiance(planar(points), planar(directions), from_camera);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t c = 0; c < 3; ++c) rays.light[own[k]][c] = exposure * light[c * n + k];
}

KnownView LitRoom::view(int v) {
  const Camera& camera = cameras_.at(static_cast<std::size_t>(v));
  const Random random = Random(seed_).fork(200 + static_cast<std::uint64_t>(v));
  const TraceMaps maps = traced_.maps(camera);
  KnownView known;
  known.view = view_of(maps, camera);
  RadianceQuery query;
  query.most_indirect = most_indirect(camera, random);
  known.view.image =
      traced_.picture(camera, options_.spp, random.seed(kPicture), kMaxDepth, kLightSamples, query.most_indirect).mean;
  const auto exposure = static_cast<float>(exposure_of(known.view.image.data));
  scale(known.view.image.data, exposure);
  if (options_.clipped)
    for (float& p : known.view.image.data) p = std::clamp(p, 0.f, 1.f);
  add_probes(known, maps, query, exposure, random.fork(kProbes));
  if (options_.predicted) known.note = predict(device_, known.view, options_.maps_weights, options_.clipped);
  for (int s = 0; s < options_.seeds; ++s) {
    Random draw = random.fork(kDraws + static_cast<std::uint64_t>(s));
    known.draws.push_back(draw_rays(known.view, options_.rows, options_.samples, kProbeRows, draw.bits()));
    query.seed = static_cast<std::uint32_t>(draw.bits());
    trace_draw(known.view, known.draws.back(), query, exposure);
  }
  return known;
}

std::vector<Vec3> LitRoom::first_surfaces(const KnownView& known, const LightRays& rays) {
  const Camera& camera = known.view.camera;
  const std::size_t n = rays.skip.size();
  std::vector<Vec3> points(n), directions(n);
  for (std::size_t i = 0; i < n; ++i) {
    points[i] = camera.to_world(true_start(known.view, rays, i));
    directions[i] = camera.direction_to_world(rays.directions[i]);
  }
  const std::vector<TraceHit> hits = traced_.hits(planar(points), planar(directions), kRayOffset, 1e9f);
  std::vector<Vec3> met(n, Vec3(std::numeric_limits<double>::infinity()));
  for (std::size_t i = 0; i < n; ++i)
    if (hits[i].triangle >= 0)
      met[i] = true_start(known.view, rays, i) + static_cast<double>(hits[i].t) * rays.directions[i];
  return met;
}

Vec3 true_start(const LightView& view, const LightRays& rays, std::size_t i) {
  if (rays.skip[i] < 0) return rays.points[i];
  const int x = rays.skip[i] % view.camera.width, y = rays.skip[i] / view.camera.width;
  const Image& n = view.true_normal;
  const Vec3 normal(n.at(0, y, x), n.at(1, y, x), n.at(2, y, x));
  return view.camera.unproject(x + 0.5, y + 0.5, static_cast<double>(view.true_depth.at(0, y, x))) +
         static_cast<double>(kRayOffset) * (normal - rays.directions[i]);
}

Scene scene_of(const LightView& view) {
  Scene scene;
  scene.camera = view.camera, scene.photo = view.image, scene.albedo = view.albedo, scene.normal = view.normal;
  scene.depth = view.depth, scene.material = view.material;
  return scene;
}

std::vector<double> probe_weights() {
  std::vector<double> weights;
  for (int y = 0; y < probe_height; ++y)
    weights.insert(weights.end(), probe_width, panorama_solid_angle(y, probe_width, probe_height));
  return weights;
}

}  // namespace clerestory
