// Rays against inserted objects, kernels/trace/objects.cl: nearest hit, point, normal and object against every triangle
// in turn, in double and in float from the same source; chunks, empty ones too.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>

#include "tests/tracer/scene_probe.hpp"
#include "tracer/bvh.hpp"
#include "tracer/random.hpp"
#include "tracer/trace_objects.hpp"

namespace clerestory {
namespace {

using V = glm::dvec3;

struct Ray {
  glm::vec3 origin, direction;
};
struct Hit {
  double distance = 0;  // 0: a miss
  V point{0}, normal{0};
  int object = -1;
};

V corner(const Mesh& mesh, std::size_t triangle, std::size_t i, bool normal) {
  const auto& all = normal ? mesh.normals : mesh.positions;
  const std::array<float, 3>& v = all[mesh.indices[triangle][i]];
  return {v[0], v[1], v[2]};
}

/// A triangle that the ray meets, or passes so close that rounding may decide.
struct Candidate {
  Hit hit;
  bool certain = false;  // met whatever the rounding
  double distance_tolerance = 0, point_tolerance = 0, normal_tolerance = 0;
  double turn = 0;  // cosine between the ray and the interpolated normal on the side that is seen
  V smooth{0}, face{0};
};

/// Every triangle in turn: origin + t d = a + u b + v c by Cramer's rule, b and c the edges from a. Rounding moves o -
/// a, and each product of three lengths, by a few epsilon: u and v err by K epsilon |o - a| L / (|b x c| |cos|), L the
/// longest edge and cos that between ray and face; t |d| errs by L times as much, a grazing ray's most of all.
std::vector<Candidate> brute_force(const std::vector<PlacedMesh>& meshes, const Ray& ray, double t_min,
                                   double epsilon) {
  constexpr double roundings = 8;
  std::vector<Candidate> candidates;
  const V o(ray.origin), d(ray.direction);
  const double length = glm::length(d);
  if (length == 0) return candidates;
  for (const PlacedMesh& placed : meshes)
    for (std::size_t i = 0; i < placed.mesh.indices.size(); ++i) {
      const V a = corner(placed.mesh, i, 0, false);
      const V b = corner(placed.mesh, i, 1, false) - a, c = corner(placed.mesh, i, 2, false) - a;
      const double determinant = glm::determinant(glm::dmat3(-d, b, c));
      if (determinant == 0) continue;
      const double t = glm::determinant(glm::dmat3(o - a, b, c)) / determinant,
                   u = glm::determinant(glm::dmat3(-d, o - a, c)) / determinant,
                   v = glm::determinant(glm::dmat3(-d, b, o - a)) / determinant;
      const double edge = std::max({glm::length(b), glm::length(c), glm::length(b - c)});
      const double condition =
          roundings * (glm::length(o - a) + edge) * edge * length / std::abs(determinant);  // |det| = |b x c| |d| |cos|
      const double doubt = condition * epsilon, t_doubt = doubt * edge / length;
      const double inside = std::min({u, v, 1 - u - v});
      if (inside < -doubt || t < t_min - t_doubt) continue;
      V n = (1 - u - v) * corner(placed.mesh, i, 0, true) + u * corner(placed.mesh, i, 1, true) +
            v * corner(placed.mesh, i, 2, true);
      const double n_length = glm::length(n);
      n /= n_length;
      V face = glm::normalize(glm::cross(b, c));
      if (glm::dot(face, d) > 0) face = -face;
      if (glm::dot(n, face) < 0) n = -n;
      const double turn = glm::dot(n, d) / length;
      Candidate met;
      met.hit = {t, o + t * d, turn > 0 ? face : n, placed.object};
      met.turn = turn, met.smooth = n, met.face = face, met.certain = inside > doubt && t > t_min + t_doubt;
      met.distance_tolerance = condition * epsilon * edge / length + roundings * epsilon * t;
      met.point_tolerance = met.distance_tolerance * length + roundings * epsilon * (glm::length(o) + t * length);
      // Weights err by condition * epsilon each, and corners' normals are at most 2 apart.
      met.normal_tolerance = (4 * condition + roundings) * epsilon / n_length;
      candidates.push_back(met);
    }
  std::ranges::sort(candidates, {}, [](const Candidate& m) { return m.hit.distance; });
  return candidates;
}

bool matches(const Candidate& met, const Hit& found) {
  const auto is = [&](const V& n) { return glm::length(found.normal - n) <= met.normal_tolerance; };
  const bool normal =
      is(met.hit.normal) || (std::abs(met.turn) <= met.normal_tolerance && (is(met.smooth) || is(met.face)));
  return found.object == met.hit.object && normal &&
         std::abs(found.distance - met.hit.distance) <= met.distance_tolerance &&
         glm::length(found.point - met.hit.point) <= met.point_tolerance;
}

/// Whether the result is the nearest hit, or one that rounding may take for it: all certain ones are farther.
bool is_nearest(const std::vector<Candidate>& candidates, const Ray& ray, const Hit& found) {
  double certain = INFINITY;
  for (const Candidate& met : candidates) {
    if (met.hit.distance - met.distance_tolerance > certain) continue;
    if (matches(met, found)) return true;
    if (met.certain) certain = std::min(certain, met.hit.distance + met.distance_tolerance);
  }
  return certain == INFINITY && found.object == -1 && found.distance == 0 && found.point == V(ray.origin) &&
         found.normal == V(0);
}

/// A chunk of `pixels` x `samples` rays inside tensors of larger capacity.
struct Layout {
  int pixels, samples, pixel_capacity, sample_capacity;
  std::size_t at(int pixel, int sample) const {
    return static_cast<std::size_t>(pixel) * static_cast<std::size_t>(sample_capacity) +
           static_cast<std::size_t>(sample);
  }
  std::size_t plane() const {
    return static_cast<std::size_t>(pixel_capacity) * static_cast<std::size_t>(sample_capacity);
  }
};

constexpr float kCanary = 12345.5f;

/// Results of a chunk as they lie in memory: what no ray wrote holds kCanary.
struct Results {
  std::vector<double> distance, point, normal;
  std::vector<int> object;
  bool operator==(const Results&) const = default;
  Hit hit(std::size_t i, std::size_t plane) const {
    const auto vec = [&](const std::vector<double>& v) { return V(v[i], v[plane + i], v[2 * plane + i]); };
    return {distance[i], vec(point), vec(normal), object[i]};
  }
};

/// Rays of a chunk, planar; the rest of the tensors is NaN, so that a ray read from outside shows.
std::vector<double> planar(const std::vector<Ray>& rays, const Layout& layout, bool directions) {
  std::vector<double> values(3 * layout.plane(), NAN);
  for (int p = 0; p < layout.pixels; ++p)
    for (int s = 0; s < layout.samples; ++s)
      for (int c = 0; c < 3; ++c) {
        const Ray& ray = rays[static_cast<std::size_t>(p * layout.samples + s)];
        values[static_cast<std::size_t>(c) * layout.plane() + layout.at(p, s)] =
            directions ? ray.direction[c] : ray.origin[c];
      }
  return values;
}

/// The tensors of a chunk on a device.
template <class Real>
struct Chunk {
  Layout layout;
  Buffer points, directions, distance, point, normal, object;
  Chunk(Device& device, const std::vector<Ray>& rays, const Layout& l)
      : layout(l),
        points(upload<Real>(device, planar(rays, l, false))),
        directions(upload<Real>(device, planar(rays, l, true))),
        distance(upload<Real>(device, std::vector<double>(l.plane(), kCanary))),
        point(upload<Real>(device, std::vector<double>(3 * l.plane(), kCanary))),
        normal(upload<Real>(device, std::vector<double>(3 * l.plane(), kCanary))) {
    const std::vector<int> canaries(l.plane(), -7);
    object = device.allocate(canaries.size() * sizeof(int));
    device.write(object, canaries.data(), canaries.size() * sizeof(int));
  }
  Results results(Device& device) const {
    const std::size_t n = layout.plane();
    Results r{download<Real>(device, distance, n), download<Real>(device, point, 3 * n),
              download<Real>(device, normal, 3 * n), std::vector<int>(n)};
    device.read(object, r.object.data(), n * sizeof(int));
    return r;
  }
};

Results meet(TraceObjects& objects, const std::vector<Ray>& rays, const Layout& layout, float t_min) {
  Device& device = test_device();
  const Chunk<float> chunk(device, rays, layout);
  const auto memory = [](const Buffer& b) { return TraceObjects::Memory{b, 0, 0}; };
  objects.meet({.points = memory(chunk.points),
                .directions = memory(chunk.directions),
                .pixels = layout.pixels,
                .samples = layout.samples,
                .pixel_capacity = layout.pixel_capacity,
                .sample_capacity = layout.sample_capacity},
               {memory(chunk.distance), memory(chunk.point), memory(chunk.normal), memory(chunk.object)}, t_min);
  return chunk.results(device);
}

/// The kernel built for double, on the tree that TraceObjects makes.
Results meet_in_double(const std::vector<PlacedMesh>& meshes, const std::vector<Ray>& rays, const Layout& layout,
                       float t_min) {
  Device device = double_device();
  std::vector<Triangle> triangles;
  std::vector<double> normals;
  std::vector<int> numbers;
  for (const PlacedMesh& placed : meshes)
    for (std::size_t i = 0; i < placed.mesh.indices.size(); ++i) {
      Triangle& t = triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        t.v[k].position = glm::vec3(corner(placed.mesh, i, k, false));
        const V n = corner(placed.mesh, i, k, true);
        normals.insert(normals.end(), {n.x, n.y, n.z});
      }
      const V a = corner(placed.mesh, i, 0, false);
      const V face =
          glm::normalize(glm::cross(corner(placed.mesh, i, 1, false) - a, corner(placed.mesh, i, 2, false) - a));
      normals.insert(normals.end(), {face.x, face.y, face.z});
      numbers.push_back(placed.object);
    }
  const Bvh bvh = build_bvh(triangles, BvhForm::wide());
  const auto reals = [&](const auto& v) { return upload<double>(device, {v.begin(), v.end()}); };
  const auto ints = [&](const std::vector<int>& v) {
    Buffer b = device.allocate(v.size() * sizeof(int));
    device.write(b, v.data(), v.size() * sizeof(int));
    return b;
  };
  const Chunk<double> chunk(device, rays, layout);
  const std::array tree{reals(bvh.planes),   ints(bvh.children), reals(bvh.corners),
                        ints(bvh.triangles), reals(normals),     ints(numbers)};
  std::vector<Arg> args(tree.begin(), tree.end());
  for (const Buffer* b :
       {&chunk.points, &chunk.directions, &chunk.distance, &chunk.point, &chunk.normal, &chunk.object})
    args.emplace_back(*b), args.emplace_back(std::uint64_t{0}), args.emplace_back(0);
  for (const int n : {0, layout.pixels, 0, layout.samples, layout.pixel_capacity, layout.sample_capacity, 0, 0})
    args.emplace_back(n);
  args.emplace_back(t_min);
  device.launch_with(device.kernel("trace/objects.cl", "meet_objects", {}, Precision::Double),
                     Range::of2(static_cast<std::size_t>(layout.samples), static_cast<std::size_t>(layout.pixels), 1),
                     args);
  return chunk.results(device);
}

glm::vec3 on_sphere(Random& random) {
  for (;;) {
    const glm::vec3 v(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1));
    if (const float l = glm::length(v); l > 0.1f && l < 1) return v / l;
  }
}

glm::vec3 in_box(Random& random, float half) {
  return {random.between(-half, half), random.between(-half, half), random.between(-half, half)};
}

/// Balls of all sizes, some in each other, and a large thin slab of two triangles.
std::vector<PlacedMesh> many_objects() {
  Random random(11);
  std::vector<PlacedMesh> meshes;
  for (int i = 0; i < 14; ++i) {
    const glm::vec3 c = in_box(random, 1.5f);
    meshes.push_back({sphere_mesh({c.x, c.y, c.z}, random.between(0.1f, 0.7f), 5), 3 * i + 1});
  }
  Mesh floor;
  floor.positions = {{-3, -2, -3}, {3, -2, -3}, {3, -2, 3}, {-3, -2, 3}};
  floor.normals.assign(4, {0, 1, 0});
  floor.indices = {{0, 2, 1}, {0, 3, 2}};
  meshes.push_back({floor, 100});
  return meshes;
}

glm::vec3 center_of(const PlacedMesh& placed) {
  const Extent e = bounds(placed.mesh);
  glm::vec3 c;
  for (int a = 0; a < 3; ++a) c[a] = (e.low[static_cast<std::size_t>(a)] + e.high[static_cast<std::size_t>(a)]) / 2;
  return c;
}

/// Rays of every kind: from anywhere, along axes, from inside a ball, grazing one, starting on one's surface;
/// directions of any length; and no ray.
std::vector<Ray> rays_of_every_kind(const std::vector<PlacedMesh>& meshes, int count) {
  Random random(5);
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) {
    const PlacedMesh& ball = meshes[static_cast<std::size_t>(i / 8) % (meshes.size() - 1)];
    const glm::vec3 center = center_of(ball);
    const std::array<float, 3>& on = ball.mesh.positions[static_cast<std::size_t>(17 * i) % ball.mesh.positions.size()];
    const glm::vec3 surface(on[0], on[1], on[2]), outwards = surface - center;
    Ray ray{in_box(random, 3), on_sphere(random) * std::exp(random.between(-2, 2))};
    switch (i % 8) {
      case 0:
        ray.direction = glm::vec3(i % 3 == 0, i % 3 == 1, i % 3 == 2) * (i % 2 ? 1.f : -1.f);
        break;
      case 1:
        ray.origin = center;
        break;
      case 2: {  // past the surface, along a tangent or nearly so
        const glm::vec3 tangent = glm::normalize(glm::cross(outwards, on_sphere(random)));
        ray.origin = surface - 2.f * tangent + random.between(-0.02f, 0.02f) * outwards, ray.direction = tangent;
        break;
      }
      case 3:
        ray.origin = surface;
        break;
      case 4:
        ray.direction = center - ray.origin;
        break;
      case 5:
        if (i % 16 == 5) ray.direction = glm::vec3(0);
        break;
      default:
        break;
    }
    rays.push_back(ray);
  }
  return rays;
}

constexpr float kTMin = 1e-3f;

void expect_nearest_hits(const std::vector<PlacedMesh>& meshes, const std::vector<Ray>& rays, const Layout& layout,
                         const Results& results, double epsilon) {
  int hits = 0, misses = 0, certain = 0;
  for (int p = 0; p < layout.pixels; ++p)
    for (int s = 0; s < layout.samples; ++s) {
      const Ray& ray = rays[static_cast<std::size_t>(p * layout.samples + s)];
      const Hit found = results.hit(layout.at(p, s), layout.plane());
      const auto candidates = brute_force(meshes, ray, kTMin, epsilon);
      ASSERT_TRUE(is_nearest(candidates, ray, found))
          << "ray " << p << ", " << s << ": object " << found.object << " at " << found.distance << "; nearest "
          << (candidates.empty() ? -1 : candidates[0].hit.object) << " at "
          << (candidates.empty() ? 0 : candidates[0].hit.distance);
      ++(found.object >= 0 ? hits : misses);
      certain += candidates.empty() || candidates[0].certain;
      if (found.object < 0) continue;
      EXPECT_LE(glm::dot(found.normal, V(ray.direction)), 4 * epsilon * glm::length(V(ray.direction)));
      EXPECT_NEAR(glm::length(found.normal), 1, 4 * epsilon);
    }
  EXPECT_GT(hits, static_cast<int>(rays.size()) / 3);
  EXPECT_GT(misses, static_cast<int>(rays.size()) / 10);
  EXPECT_GT(certain, static_cast<int>(rays.size()) * 3 / 4) << "rounding decides too much to test anything";
}

TEST(Objects, NearestHitsOfManyObjects) {
  const auto meshes = many_objects();
  const Layout layout{40, 24, 40, 24};
  const auto rays = rays_of_every_kind(meshes, layout.pixels * layout.samples);
  TraceObjects objects(test_device(), meshes);
  const Results results = meet(objects, rays, layout, kTMin);
  expect_nearest_hits(meshes, rays, layout, results, FLT_EPSILON);
  EXPECT_EQ(meet(objects, rays, layout, kTMin), results) << "run to run";
}

TEST(Objects, NearestHitsInDouble) {
  const auto meshes = many_objects();
  const Layout layout{40, 24, 40, 24};
  const auto rays = rays_of_every_kind(meshes, layout.pixels * layout.samples);
  expect_nearest_hits(meshes, rays, layout, meet_in_double(meshes, rays, layout, kTMin), DBL_EPSILON);
}

/// From a ball's centre every ray meets the inside, and its normal looks back at the centre.
TEST(Objects, InsideOfABall) {
  const glm::vec3 center(0.5f, -1, -2);
  TraceObjects objects(test_device(), {{sphere_mesh({center.x, center.y, center.z}, 0.75f, 64), 9}});
  Random random(2);
  const Layout layout{16, 8, 16, 8};
  std::vector<Ray> rays;
  for (int i = 0; i < 128; ++i) rays.push_back({center, on_sphere(random)});
  const Results results = meet(objects, rays, layout, kTMin);
  // A chord of pi / 64 radians lies (pi / 128)^2 / 2 of the radius inside its arc; of a cell's two directions, twice.
  const double sagitta = 0.75 * std::pow(3.14159 / 128, 2);
  for (int i = 0; i < 128; ++i) {
    const Hit hit = results.hit(static_cast<std::size_t>(i), layout.plane());
    EXPECT_EQ(hit.object, 9);
    EXPECT_NEAR(hit.distance, 0.75, sagitta + 16 * FLT_EPSILON);
    EXPECT_GT(glm::dot(hit.normal, -V(rays[static_cast<std::size_t>(i)].direction)), 0.999);
  }
}

/// Corners that faces share, and their normals: an interpolated one may look away from a ray that meets the front.
TEST(Objects, AFaceIsSeenFromItsOwnSide) {
  Mesh cube;
  for (int i = 0; i < 8; ++i) {
    const glm::vec3 corner(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1), n = glm::normalize(corner);
    cube.positions.push_back({corner.x, corner.y, corner.z}), cube.normals.push_back({n.x, n.y, n.z});
  }
  cube.indices = {{4, 5, 7}, {4, 7, 6}, {0, 3, 1}, {0, 2, 3}, {1, 3, 7}, {1, 7, 5},
                  {0, 4, 6}, {0, 6, 2}, {2, 6, 7}, {2, 7, 3}, {0, 1, 5}, {0, 5, 4}};
  TraceObjects objects(test_device(), {{cube, 1}});
  Random random(5);
  const Layout layout{64, 16, 64, 16};
  std::vector<Ray> rays;
  for (int i = 0; i < 64 * 16; ++i) {
    const glm::vec3 from = 2.f * on_sphere(random), near_a_corner = 0.9f * glm::sign(in_box(random, 1));
    rays.push_back({from, glm::normalize(near_a_corner - from)});
  }
  const Results results = meet(objects, rays, layout, kTMin);
  int turned = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit hit = results.hit(i, layout.plane());
    ASSERT_EQ(hit.object, 1);
    V face(0);  // of the side that the point lies on
    for (int a = 0; a < 3; ++a)
      if (std::abs(std::abs(hit.point[a]) - 1) < 1e-4) face[a] = hit.point[a] > 0 ? 1 : -1;
    const V smooth = glm::normalize(hit.point), d(rays[i].direction);
    EXPECT_GT(glm::dot(hit.normal, face), 0) << "lit from inside";
    EXPECT_LE(glm::dot(hit.normal, d), 1e-6);
    turned += glm::dot(smooth, d) > 0;
  }
  EXPECT_GT(turned, 10) << "of rays that the corners' normals look away from";
}

TEST(Objects, OnlyTheChunksRaysAreWritten) {
  const auto meshes = many_objects();
  const Layout tight{5, 7, 5, 7}, roomy{5, 7, 8, 9};
  const auto rays = rays_of_every_kind(meshes, 35);
  TraceObjects objects(test_device(), meshes);
  const Results expected = meet(objects, rays, tight, kTMin), found = meet(objects, rays, roomy, kTMin);
  for (int p = 0; p < roomy.pixel_capacity; ++p)
    for (int s = 0; s < roomy.sample_capacity; ++s) {
      const Hit hit = found.hit(roomy.at(p, s), roomy.plane());
      if (p < 5 && s < 7) {
        const Hit same = expected.hit(tight.at(p, s), tight.plane());
        EXPECT_TRUE(hit.distance == same.distance && hit.point == same.point && hit.normal == same.normal &&
                    hit.object == same.object);
      } else {
        EXPECT_TRUE(hit.distance == kCanary && hit.point == V(kCanary) && hit.normal == V(kCanary) && hit.object == -7);
      }
    }
  for (const Layout& empty : {Layout{0, 7, 8, 9}, Layout{5, 0, 8, 9}}) {
    const Results nothing = meet(objects, rays, empty, kTMin);
    EXPECT_EQ(nothing.distance, std::vector<double>(empty.plane(), kCanary));
    EXPECT_EQ(nothing.object, std::vector<int>(empty.plane(), -7));
  }
}

/// Origins in the map of the whole picture: pixel p of the chunk starts where its own pixel of the map says.
TEST(Objects, OriginsOfTheWholePicture) {
  const auto meshes = many_objects();
  const Layout layout{6, 4, 6, 4};
  const int first_pixel = 3, plane = 11;
  auto rays = rays_of_every_kind(meshes, 24);
  std::vector<double> map(3 * plane, NAN);
  for (int p = 0; p < layout.pixels; ++p)
    for (int s = 0; s < layout.samples; ++s) {
      rays[static_cast<std::size_t>(4 * p + s)].origin = rays[static_cast<std::size_t>(4 * p)].origin;
      for (int c = 0; c < 3; ++c)
        map[static_cast<std::size_t>(c * plane + first_pixel + p)] = rays[static_cast<std::size_t>(4 * p)].origin[c];
    }
  TraceObjects objects(test_device(), meshes);
  const Results expected = meet(objects, rays, layout, kTMin);
  const Chunk<float> chunk(test_device(), rays, layout);
  const auto memory = [](const Buffer& b) { return TraceObjects::Memory{b, 0, 0}; };
  objects.meet({.points = memory(upload<float>(test_device(), map)),
                .directions = memory(chunk.directions),
                .per_pixel = true,
                .plane = plane,
                .first_pixel = first_pixel,
                .pixels = layout.pixels,
                .samples = layout.samples,
                .pixel_capacity = layout.pixel_capacity,
                .sample_capacity = layout.sample_capacity},
               {memory(chunk.distance), memory(chunk.point), memory(chunk.normal), memory(chunk.object)}, kTMin);
  EXPECT_EQ(chunk.results(test_device()), expected);
}

TEST(Objects, NothingAndNonsenseAreRefused) {
  EXPECT_THROW(TraceObjects(test_device(), {}), Error);
  EXPECT_THROW(TraceObjects(test_device(), {{Mesh(), 1}}), Error);
  EXPECT_THROW(TraceObjects(test_device(), {{sphere_mesh({NAN, 0, 0}, 1, 4), 1}}), Error);
}

}  // namespace
}  // namespace clerestory
