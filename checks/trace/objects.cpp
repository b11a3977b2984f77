// Rays against inserted meshes: the nearest hit of every triangle in turn, in double.
#include <algorithm>
#include <cmath>

#include "checks/kernel_check.hpp"
#include "tracer/random.hpp"
#include "tracer/trace_objects.hpp"

namespace clerestory {
namespace {

using V = glm::dvec3;
constexpr int kPixels = 37, kSamples = 11;
constexpr double kTMin = 1e-3;

struct Nearest {
  double distance = 0;  // of a hit, in lengths of the direction
  V normal{0};
  int object = -1;
};

V corner(const std::vector<std::array<float, 3>>& of, const Mesh& mesh, std::size_t triangle, std::size_t k) {
  const std::array<float, 3>& v = of[mesh.indices[triangle][k]];
  return {v[0], v[1], v[2]};
}

/// o + t d = a + u b + v c by Cramer's rule, b and c the edges from a.
Nearest nearest(const std::vector<PlacedMesh>& meshes, const V& o, const V& d) {
  Nearest best;
  for (const PlacedMesh& placed : meshes)
    for (std::size_t i = 0; i < placed.mesh.indices.size(); ++i) {
      const Mesh& m = placed.mesh;
      const V a = corner(m.positions, m, i, 0), b = corner(m.positions, m, i, 1) - a,
              c = corner(m.positions, m, i, 2) - a;
      const double determinant = glm::determinant(glm::dmat3(-d, b, c));
      const double t = glm::determinant(glm::dmat3(o - a, b, c)) / determinant,
                   u = glm::determinant(glm::dmat3(-d, o - a, c)) / determinant,
                   v = glm::determinant(glm::dmat3(-d, b, o - a)) / determinant;
      if (!(std::min({u, v, 1 - u - v}) >= 0) || t < kTMin || (best.object >= 0 && t > best.distance)) continue;
      V face = glm::normalize(glm::cross(b, c));
      if (glm::dot(face, d) > 0) face = -face;
      V n = glm::normalize((1 - u - v) * corner(m.normals, m, i, 0) + u * corner(m.normals, m, i, 1) +
                           v * corner(m.normals, m, i, 2));
      if (glm::dot(n, face) < 0) n = -n;
      if (glm::dot(n, d) > 0) n = face;
      best = {t, n, placed.object};
    }
  return best;
}

/// What one launch writes: distance, point, normal, object, each in the rays' layout.
struct Written {
  std::vector<double> distance, point, normal, object;
  bool operator==(const Written&) const = default;
};

Written meet(Device device, const BvhForm& form, const std::vector<PlacedMesh>& meshes,
             const std::vector<float>& points, const std::vector<float>& directions) {
  TraceObjects objects(device, meshes, form);
  const auto memory = [](const Buffer& b) { return TraceObjects::Memory{b, 0, 0}; };
  const auto floats = [&](std::size_t count) { return device.allocate(count * sizeof(float)); };
  const std::size_t rays = kPixels * kSamples;
  const Buffer from = uploaded(device, points), towards = uploaded(device, directions), distance = floats(rays),
               point = floats(3 * rays), normal = floats(3 * rays), object = floats(rays);
  objects.meet({.points = memory(from),
                .directions = memory(towards),
                .pixels = kPixels,
                .samples = kSamples,
                .pixel_capacity = kPixels,
                .sample_capacity = kSamples},
               {memory(distance), memory(point), memory(normal), memory(object)}, static_cast<float>(kTMin));
  return {downloaded<float>(device, distance), downloaded<float>(device, point), downloaded<float>(device, normal),
          downloaded<std::int32_t>(device, object)};
}

void check(const Device& device, const BvhForm& form, OpFindings& findings) {
  const std::vector<PlacedMesh> meshes{{sphere_mesh({0, 0, -3}, 1, 6), 3},
                                       {sphere_mesh({0.8f, 0.3f, -2.5f}, 0.5f, 5), 7}};
  constexpr std::size_t rays = kPixels * kSamples;
  Random random(8);
  std::vector<float> points(3 * rays), directions(3 * rays);
  for (std::size_t i = 0; i < rays; ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      points[c * rays + i] = random.between(-0.5f, 0.5f);
      directions[c * rays + i] = c == 2 ? -1.f : random.between(-0.6f, 0.6f);
    }
  const Written found = meet(device, form, meshes, points, directions);
  if (!(meet(device, form, meshes, points, directions) == found))
    findings.faults.push_back(fmt::format("meet_objects, {} wide, second run: other bits", form.width));
  std::vector<double> got, want;
  int hits = 0, other = 0;
  for (std::size_t i = 0; i < rays; ++i) {
    const auto vec = [&](const auto& v) { return V(v[i], v[rays + i], v[2 * rays + i]); };
    const V o = vec(points), d = vec(directions);
    const Nearest hit = nearest(meshes, o, d);
    hits += hit.object >= 0;
    if (found.object[i] != hit.object) {
      ++other;  // past an edge or a silhouette, within a rounding
      continue;
    }
    const V at = hit.object < 0 ? o : o + hit.distance * d;
    for (const double x : {found.distance[i], found.point[i], found.point[rays + i], found.point[2 * rays + i],
                           found.normal[i], found.normal[rays + i], found.normal[2 * rays + i]})
      got.push_back(x);
    want.insert(want.end(), {hit.distance, at.x, at.y, at.z, hit.normal.x, hit.normal.y, hit.normal.z});
  }
  if (hits < 100 || other > 3)
    findings.faults.push_back(
        fmt::format("meet_objects, {} wide: {} hits, {} of other objects", form.width, hits, other));
  // Of 4 metres: products of three lengths, over the cosine at which a triangle is met, a hundredth at worst.
  expect_close(findings, fmt::format("meet_objects, {} wide", form.width), got, want, 600);
}

}  // namespace

KERNEL_CHECK(objects) {
  return {.stem = "objects",
          .kernels = {"meet_objects"},
          .run = [](const CheckedDevices& devices, OpFindings& findings, bool) {
            for (const BvhForm& form : {BvhForm::wide(), BvhForm::short_stack()})
              if (form.fits(devices.single)) check(devices.single, form, findings);
          }};
}

}  // namespace clerestory
