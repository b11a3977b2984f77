#include "tracer/probes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "host/math/panorama.hpp"

namespace clerestory {
namespace {

constexpr int kAttempts = 200, kFlights = 2;
constexpr float kShareBeforeCamera = 0.75f;

double squared(const Vec3& v) { return glm::dot(v, v); }

double squared_distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double length = squared(along);
  const double t = length > 0 ? std::clamp(glm::dot(p - a, along) / length, 0.0, 1.0) : 0;
  return squared(p - (a + t * along));
}

/// The foot of the perpendicular where it lies inside, else the nearest side.
double squared_distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = glm::cross(b - a, c - a);
  const auto inside = [&](const Vec3& from, const Vec3& to) {
    return glm::dot(glm::cross(to - from, p - from), n) >= 0;
  };
  const double area = squared(n);
  if (area > 0 && inside(a, b) && inside(b, c) && inside(c, a)) {
    const double height = glm::dot(p - a, n);
    return height * height / area;
  }
  return std::min({squared_distance_to_segment(p, a, b), squared_distance_to_segment(p, b, c),
                   squared_distance_to_segment(p, c, a)});
}

bool is_visible(const Camera& camera, const TraceMaps& maps, const Vec3& point) {
  const std::optional<Vec2> at = camera.project(point);
  if (!at || at->x < 0 || at->y < 0 || at->x >= camera.width || at->y >= camera.height) return false;
  const float depth = maps.depth.at(0, static_cast<int>(at->y), static_cast<int>(at->x));
  return depth > 0 && -point.z < static_cast<double>(depth);
}

/// Share of the way to a surface: uniform in the volume of a cone.
double share_of_way(Random& random) { return std::cbrt(static_cast<double>(random.unit())); }

std::optional<Vec3> point_before_camera(const Camera& camera, const TraceMaps& maps, Random& random) {
  const float u = random.unit(), v = random.unit();
  const int x = std::min(camera.width - 1, static_cast<int>(u * static_cast<float>(camera.width))),
            y = std::min(camera.height - 1, static_cast<int>(v * static_cast<float>(camera.height)));
  const double share = share_of_way(random);
  const float depth = maps.depth.at(0, y, x);
  if (depth <= 0) return std::nullopt;
  return camera.unproject(x + 0.5, y + 0.5, share * static_cast<double>(depth));
}

/// Where straight flights in random directions lead, each a part of the way to what it would meet.
std::optional<Vec3> point_by_flights(TraceScene& scene, const Camera& camera, Random& random) {
  Vec3 at = camera.position();
  for (int flight = 0; flight < kFlights; ++flight) {
    const double z = 1 - 2 * static_cast<double>(random.unit()), across = std::sqrt(1 - z * z),
                 turn = 2 * std::numbers::pi * static_cast<double>(random.unit()), share = share_of_way(random);
    const Vec3 d(across * std::cos(turn), z, across * std::sin(turn));
    const TraceHit hit = scene.hits(planar({{at}}), planar({{d}}), 0, 1e9f)[0];
    if (hit.triangle < 0) return std::nullopt;  // out of the room
    at += share * static_cast<double>(hit.t) * d;
  }
  return camera.to_camera(at);
}

std::optional<Probe> place_probe(TraceScene& scene, const World& world, const Camera& camera, const TraceMaps& maps,
                                 Random random) {
  const bool before_camera = random.chance(kShareBeforeCamera);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::optional<Vec3> point =
        before_camera ? point_before_camera(camera, maps, random) : point_by_flights(scene, camera, random);
    if (!point) continue;
    const double distance = distance_to_surface(world, camera.to_world(*point));
    if (distance < kProbeClearance) continue;
    Probe probe;
    probe.center = *point, probe.distance = distance, probe.visible = is_visible(camera, maps, *point);
    return probe;
  }
  return std::nullopt;
}

}  // namespace

double distance_to_surface(const World& world, const Vec3& point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Triangle& t : world.triangles) {
    nearest = std::min(nearest, squared_distance_to_triangle(point, Vec3(t.v[0].position), Vec3(t.v[1].position),
                                                             Vec3(t.v[2].position)));
  }
  return std::sqrt(nearest);
}

std::vector<Probe> place_probes(TraceScene& scene, const World& world, const Camera& camera, const TraceMaps& maps,
                                int count, const Random& random) {
  std::vector<Probe> probes;
  for (int k = 0; k < count; ++k) {
    std::optional<Probe> probe = place_probe(scene, world, camera, maps, random.fork(static_cast<std::uint64_t>(k)));
    if (probe) probes.push_back(std::move(*probe));
  }
  return probes;
}

void trace_probe(TraceScene& scene, const Camera& camera, Probe& probe, const RadianceQuery& query,
                 DroppedSamples* dropped) {
  probe.radiance = Image(probe_width, probe_height, 3);
  const std::size_t texels = probe.radiance.pixels();
  std::vector<Vec3> directions(texels);
  for (std::size_t i = 0; i < texels; ++i)
    directions[i] = panorama_direction(static_cast<int>(i) % probe_width, static_cast<int>(i) / probe_width,
                                       probe_width, probe_height);
  RadianceQuery from_camera = query;
  from_camera.to_world = camera.camera_to_world;
  from_camera.spread = 2 * std::numbers::pi_v<float> / probe_width;
  probe.radiance.data =
      scene.radiance(planar(std::vector(texels, probe.center)), planar(directions), from_camera, dropped);
}

Image trace_probe_twice(TraceScene& scene, const Camera& camera, Probe& probe, RadianceQuery query,
                        const std::array<std::uint32_t, 2>& seeds) {
  query.seed = seeds[0];
  trace_probe(scene, camera, probe, query);
  Probe other = probe;
  query.seed = seeds[1];
  trace_probe(scene, camera, other, query);
  Image variance(probe_width, probe_height, 3);
  for (std::size_t i = 0; i < variance.data.size(); ++i) {
    float& mean = probe.radiance.data[i];
    const float difference = mean - other.radiance.data[i];
    variance.data[i] = difference * difference / 4;
    mean = (mean + other.radiance.data[i]) / 2;
  }
  return variance;
}

}  // namespace clerestory
