// The path tracer's kernels: hits, maps, light and pictures against an independent path tracer in plain C++, every
// answer in float against the same kernels in double and the same random numbers, two runs bit for bit.
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <map>

#include "checks/kernel_check.hpp"
#include "checks/trace/path_reference.hpp"
#include "tracer/shapes.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {
namespace {

using reference::V;

// What rounding decides, a shadow's edge or a lobe, is a rate; other numbers agree by arithmetic: a ray that lands two
// roundings beside its place sees a lamp a third of the room away turned by 4 epsilon times 3, over cosines of a tenth.
constexpr double kDecided = 1e-2, kRoundings = 2048;
constexpr double kFewDecided = 6;  // two rays of three channels, however few there are
// Of means, whose seeds are fixed: seven in a million would fail by chance.
constexpr double kSigmas = 4.5;

Material plain(const glm::vec3& albedo, float roughness, float metallic) {
  Material m;
  m.color_a = m.color_b = m.color_c = albedo;
  m.roughness_a = m.roughness_b = m.roughness_c = roughness;
  m.metallic_a = m.metallic_b = m.metallic_c = metallic;
  m.uncapped = 1;
  return m;
}

/// A closed room seen from inside, with a metal ball of smooth normals, a lamp, and a pane before an uneven sky.
World room() {
  World world;
  Shapes shapes(world, glm::mat4(1), Random(1));
  const int wall = shapes.material(plain({0.7f, 0.5f, 0.3f}, 0.8f, 0));
  shapes.box({-2, 0, -2}, {2, 2.5f, 2}, wall);
  for (Triangle& t : world.triangles) {
    std::swap(t.v[1], t.v[2]);
    for (Vertex& v : t.v) v.normal = -v.normal;
  }
  shapes.sphere({0.6f, 0.6f, 0.1f}, 0.5f, shapes.material(plain({0.9f, 0.7f, 0.4f}, 0.6f, 1)), 5);
  const int lamp = shapes.emitter({{6, 5, 4}, false}), pane = shapes.emitter({{1, 0.9f, 0.8f}, true});
  shapes.quad({-0.6f, 2.49f, -0.6f}, {0.6f, 2.49f, -0.6f}, {0.6f, 2.49f, 0.6f}, {-0.6f, 2.49f, 0.6f}, wall, lamp);
  shapes.quad({-1.99f, 0.8f, 1}, {-1.99f, 0.8f, -1}, {-1.99f, 2, -1}, {-1.99f, 2, 1}, wall, pane);
  world.panorama = {16, 8, {}};
  for (int i = 0; i < 16 * 8 * 3; ++i) world.panorama.rgb.push_back(1.f + static_cast<float>(i * 5 % 7));
  world.panorama_turn = 0.4f;
  return world;
}

constexpr int kLastTexture = static_cast<int>(Texture::Print);

/// The same with every surface textured, by as many families from `first` on: what has no reference here has its
/// double.
World textured(World world, int first) {
  for (std::size_t i = 0; i < world.materials.size(); ++i) {
    Material& m = world.materials[i];
    m.texture = static_cast<float>((first - 1 + static_cast<int>(i)) % kLastTexture + 1);
    m.color_b = glm::vec3(0.2f), m.scale = glm::vec3(3), m.noise = 0.3f;
  }
  return world;
}

/// Widths and heights are no multiples of a work-group's size.
Camera camera_into_room(int width, int height) {
  Camera camera = Camera::from_fov(width, height, 80);
  look_at(camera, {1.5, 1.6, 1.7}, {-0.2, 0.8, -0.7});
  return camera;
}

Camera camera_into_room(bool quick) { return quick ? camera_into_room(7, 5) : camera_into_room(23, 17); }

/// Rays from about the middle of the room, planar {3, count}.
struct Rays {
  std::vector<float> points, directions;
  int count = 0;
  glm::dvec3 at(const std::vector<float>& planar, int i) const {
    const auto part = [&](int c) { return static_cast<double>(planar[static_cast<std::size_t>(c * count + i)]); };
    return {part(0), part(1), part(2)};
  }
};

Rays rays_in_room(int count) {
  Random random(5);
  Rays rays{std::vector<float>(3 * static_cast<std::size_t>(count)), {}, count};
  rays.directions = rays.points;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t at = c * static_cast<std::size_t>(count) + i;
      rays.points[at] = random.between(-0.3f, 0.3f) + (c == 1 ? 1.6f : 0.f);
      rays.directions[at] = random.between(-1, 1);
    }
  return rays;
}

template <class T>
void expect_same(OpFindings& findings, const char* what, const T& a, const T& b) {
  if (a != b) findings.faults.push_back(fmt::format("{}, second run: other bits", what));
}

/// All but a few numbers within so many roundings of their own size, and no darker or brighter in sum.
void expect_twins(OpFindings& findings, const std::string& what, const std::vector<float>& single,
                  const std::vector<float>& twin, double roundings) {
  std::vector<double> ulps;
  long far = 0;
  for (std::size_t i = 0; i < single.size(); ++i) {
    const double x = static_cast<double>(single[i]), y = static_cast<double>(twin[i]);
    if (x == y) continue;
    const double off = std::abs(x - y) / (FLT_EPSILON * std::max(std::abs(x), std::abs(y)));
    if (!(off <= roundings))
      ++far;
    else
      ulps.push_back(off);
  }
  if (!ulps.empty()) findings.value_ulps = worse(findings.value_ulps, std::ranges::max(ulps));
  const double allowed = kFewDecided + kDecided * static_cast<double>(single.size());
  findings.twin_error = worse(findings.twin_error, static_cast<double>(far) / allowed);
  if (single.empty() || static_cast<double>(far) > allowed)
    findings.faults.push_back(
        fmt::format("{}, float against double: {} of {} numbers are off by more than {} roundings", what, far,
                    single.size(), roundings));
}

void hits(TraceScene& scene, const reference::PathTracer& reference, OpFindings& findings, const std::string& precision,
          bool quick) {
  const Rays rays = rays_in_room(quick ? 61 : 700);
  const std::vector<TraceHit> found = scene.hits(rays.points, rays.directions, 1e-3f, 1e6f);
  std::vector<double> got, want;
  int other = 0;
  for (int i = 0; i < rays.count; ++i) {
    const auto hit = reference.nearest(rays.at(rays.points, i), rays.at(rays.directions, i), 1e30);
    const TraceHit& f = found[static_cast<std::size_t>(i)];
    if (!hit || static_cast<std::size_t>(f.triangle) != hit->facet) {
      ++other;  // through an edge, within a rounding
      continue;
    }
    got.insert(got.end(), {static_cast<double>(f.t), static_cast<double>(f.u), static_cast<double>(f.v)});
    want.insert(want.end(), {hit->t, hit->u, hit->v});
  }
  if (other > kFewDecided / 3 + kDecided * rays.count)
    findings.faults.push_back(
        fmt::format("trace_hits in {}: {} of {} rays meet another triangle", precision, other, rays.count));
  // Of the farthest hit: three products of lengths, over the cosine at which a triangle is met, a hundredth at worst.
  expect_close(findings, fmt::format("trace_hits in {}", precision), got, want, 600);
}

/// Light along rays by two scatterings, in the mean over paths. kSigmas of both, so of their sum.
void light(TraceScene& scene, const reference::PathTracer& reference, OpFindings& findings,
           const std::string& precision, bool quick) {
  const int paths = quick ? 30 : 1500;
  const Rays rays = rays_in_room(quick ? 8 : 24);
  RadianceQuery query;
  query.seed = 4, query.max_depth = 2, query.spp = 1;
  Rays many{{}, {}, rays.count * paths};
  for (const auto& [from, to] : {std::pair{&rays.points, &many.points}, {&rays.directions, &many.directions}})
    for (std::size_t i = 0; i < from->size(); ++i) to->insert(to->end(), paths, (*from)[i]);
  const std::vector<float> found = scene.radiance(many.points, many.directions, query);
  Random random(31);
  for (int i = 0; i < rays.count; ++i) {
    double sum[2] = {0, 0}, squares[2] = {0, 0};
    for (int k = 0; k < paths; ++k) {
      const V l = reference.radiance(rays.at(rays.points, i), glm::normalize(rays.at(rays.directions, i)),
                                     query.max_depth, random);
      double mine = 0;
      for (int c = 0; c < 3; ++c)
        mine += static_cast<double>(found[static_cast<std::size_t>((c * rays.count + i) * paths + k)]);
      for (const auto& [which, value] : {std::pair{0, mine}, {1, l.x + l.y + l.z}})
        sum[which] += value / paths, squares[which] += value * value / paths;
    }
    double variance = 0;
    for (const int which : {0, 1}) variance += std::max(0.0, squares[which] - sum[which] * sum[which]) / paths;
    // 1e-3: rays start 0.1 mm off the surface.
    const double allowed = kSigmas * std::sqrt(variance) + 1e-3 * sum[1], error = std::abs(sum[0] - sum[1]);
    findings.value_error = worse(findings.value_error, std::isnan(error) ? INFINITY : error / allowed);
    if (!(error <= allowed))
      findings.faults.push_back(fmt::format("mean_radiance of trace_rays in {}: ray {} brings {} instead of {} +- {}",
                                            precision, i, sum[0], sum[1], allowed));
  }
}

V towards_pixel(const Camera& camera, std::size_t pixel) {
  const auto width = static_cast<std::size_t>(camera.width);
  return camera.direction_to_world(
      camera.direction(static_cast<double>(pixel % width) + 0.5, static_cast<double>(pixel / width) + 0.5));
}

/// A picture by two scatterings, its mean and the variance of that in every pixel and channel.
void picture(TraceScene& scene, const reference::PathTracer& reference, OpFindings& findings,
             const std::string& precision, bool quick) {
  const int paths = quick ? 30 : 1500;
  const Camera camera = camera_into_room(quick ? 3 : 7, quick ? 2 : 5);
  const TracePicture found = scene.picture(camera, paths, 9, 2), again = scene.picture(camera, paths, 10, 2);
  double between = 0, told = 0;  // squared differences of the two, and what their variances promise
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
  Random random(47);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    V sum(0), squares(0);
    for (int k = 0; k < paths; ++k) {
      const V l = reference.radiance(camera.position(), towards_pixel(camera, pixel), 2, random);
      sum += l / static_cast<double>(paths), squares += l * l / static_cast<double>(paths);
    }
    for (int c = 0; c < 3; ++c) {
      const double mine = static_cast<double>(found.mean.plane(c)[pixel]),
                   other = static_cast<double>(again.mean.plane(c)[pixel]),
                   own = static_cast<double>(found.variance.plane(c)[pixel]),
                   plain = std::max(0.0, squares[c] - sum[c] * sum[c]) / paths;
      between += (mine - other) * (mine - other), told += 2 * own;
      // The kernel joins two ways to draw, so that its own variance, if it is right, is the smaller one.
      const double variance = plain + std::min(own, plain);
      const double allowed = kSigmas * std::sqrt(variance) + 1e-3 * sum[c], error = std::abs(mine - sum[c]);
      findings.value_error = worse(findings.value_error, std::isnan(error) ? INFINITY : error / allowed);
      if (!(error <= allowed))
        findings.faults.push_back(fmt::format("trace_view in {}: channel {} of pixel {} is {} instead of {} +- {}",
                                              precision, c, pixel, mine, sum[c], allowed));
    }
  }
  // Of some hundred numbers, of which three channels go together: a factor of three is far beyond chance.
  if (!quick && !(between < 3 * told && told < 3 * between))
    findings.faults.push_back(
        fmt::format("trace_view in {}: two pictures are {} apart, told {}", precision, between, told));
}

/// What lies under the centres of pixels.
void maps(TraceScene& scene, const reference::PathTracer& reference, OpFindings& findings, const std::string& precision,
          bool quick) {
  const Camera camera = camera_into_room(quick);
  const TraceMaps found = scene.maps(camera);
  std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> got_want;
  int other = 0;
  for (std::size_t pixel = 0; pixel < found.triangle.size(); ++pixel) {
    const V d = towards_pixel(camera, pixel);
    const auto hit = reference.nearest(camera.position(), d, 1e30);
    if (!hit || static_cast<std::size_t>(found.triangle[pixel]) != hit->facet) {
      ++other;  // through an edge, within a rounding
      continue;
    }
    const auto surface = reference.surface(*hit, d);
    const auto compare = [&, pixel](const char* name, const Image& map, const V& want) {
      for (int c = 0; c < map.channels; ++c)
        got_want[name].first.push_back(static_cast<double>(map.plane(c)[pixel])),
            got_want[name].second.push_back(want[c]);
    };
    compare("depth", found.depth, V(-hit->t * camera.direction_to_camera(d).z));
    compare("normal", found.normal, camera.direction_to_camera(surface.normal));
    compare("albedo", found.albedo, V(surface.material->color_a));
    compare("roughness", found.roughness, V(surface.material->roughness_a));
    compare("metallic", found.metallic, V(surface.material->metallic_a));
    compare("emission", found.emission, surface.emission);
    other += found.emitter[pixel] != surface.emitter;
  }
  if (other > kFewDecided / 3 + kDecided * static_cast<double>(found.triangle.size()))
    findings.faults.push_back(fmt::format("trace_maps in {}: {} of {} pixels show another triangle or emitter",
                                          precision, other, found.triangle.size()));
  // As hits: normals and the sky are looked up where the ray lands.
  for (const auto& [name, values] : got_want)
    expect_close(findings, fmt::format("trace_maps in {}, {}", precision, name), values.first, values.second, 600);
}

struct Answers {
  std::vector<float> radiance, picture, maps;
  std::vector<int> triangles;
};

Answers answers_of(TraceScene& scene, bool quick) {
  const Camera camera = camera_into_room(quick);
  const Rays rays = rays_in_room(quick ? 41 : 901);
  RadianceQuery query;
  query.seed = 12, query.max_depth = 3;
  const TraceMaps maps = scene.maps(camera);
  Answers a{
      scene.radiance(rays.points, rays.directions, query), scene.picture(camera, 3, 3, 3).mean.data, {}, maps.triangle};
  for (const Image* map : {&maps.depth, &maps.normal, &maps.albedo, &maps.roughness, &maps.metallic, &maps.emission})
    a.maps.insert(a.maps.end(), map->data.begin(), map->data.end());
  return a;
}

void twins(const CheckedDevices& devices, const World& world, const BvhForm& form, OpFindings& findings, bool quick) {
  TraceScene scene(devices.single, world, Precision::Single, form);
  const Answers single = answers_of(scene, quick);
  const Answers again = answers_of(scene, quick);
  expect_same(findings, "mean_radiance of trace_rays", again.radiance, single.radiance);
  expect_same(findings, "trace_view", again.picture, single.picture);
  expect_same(findings, "trace_maps", std::pair(again.maps, again.triangles), std::pair(single.maps, single.triangles));
  if (!devices.with_doubles) return;
  TraceScene twin(*devices.with_doubles, world, Precision::Double, form);
  const Answers twins = answers_of(twin, quick);
  expect_twins(findings, "mean_radiance of trace_rays", single.radiance, twins.radiance, 3 * kRoundings);
  expect_twins(findings, "trace_view", single.picture, twins.picture, 3 * 3 * kRoundings);
  expect_twins(findings, "trace_maps", single.maps, twins.maps, kRoundings);
}

}  // namespace

KERNEL_CHECK(path) {
  return {.stem = "path",
          .kernels = {"trace_view", "trace_rays", "trace_hits", "trace_maps", "mean_radiance"},
          .run = [](const CheckedDevices& devices, OpFindings& findings, bool quick) {
            const World world = room();
            const reference::PathTracer reference(world);
            const auto in = [&](const Device& device, Precision precision, const BvhForm& form, const char* name) {
              TraceScene scene(device, world, precision, form);
              const std::string what = fmt::format("{}, {} wide", name, form.width);
              hits(scene, reference, findings, what, quick), light(scene, reference, findings, what, quick);
              picture(scene, reference, findings, what, quick), maps(scene, reference, findings, what, quick);
            };
            for (const BvhForm& form : {BvhForm::wide(), BvhForm::short_stack()}) {
              if (!form.fits(devices.single)) continue;
              in(devices.single, Precision::Single, form, "float");
              if (devices.with_doubles) in(*devices.with_doubles, Precision::Double, form, "double");
              twins(devices, world, form, findings, quick);
              for (int first = 1; first <= (quick ? 1 : kLastTexture);
                   first += static_cast<int>(world.materials.size()))
                twins(devices, textured(world, first), form, findings, quick);
            }
          }};
}

}  // namespace clerestory
