// Traversal against Embree's own, which is the oracle here and nowhere else.
#include "tracer/bvh.hpp"

#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include "tests/tracer/scenes.hpp"
#include "tracer/room.hpp"
#include "tracer/trace_objects.hpp"

namespace clerestory {
namespace {

struct OracleHit {
  float t = 0, u = 0, v = 0;
  int triangle = -1;
};

class Oracle {
 public:
  explicit Oracle(const std::vector<Triangle>& triangles)
      : device_(rtcNewDevice("threads=1"), rtcReleaseDevice), scene_(rtcNewScene(device_.get()), rtcReleaseScene) {
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* corners = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * triangles.size()));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        indices[3 * i + k] = static_cast<unsigned>(3 * i + k);
        for (int a = 0; a < 3; ++a) corners[9 * i + 3 * k + a] = triangles[i].v[k].position[a];
      }
    }
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_.get());
  }
  OracleHit trace(const glm::vec3& o, const glm::vec3& d) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit r;
    r.ray = {o.x, o.y, o.z, 0, d.x, d.y, d.z, 0, 1e9f, ~0u, 0, 0};
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_.get(), &context, &r);
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    return {r.ray.tfar, r.hit.u, r.hit.v, static_cast<int>(r.hit.primID)};
  }

 private:
  std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device_;
  std::unique_ptr<RTCSceneTy, decltype(&rtcReleaseScene)> scene_;
};

glm::vec3 on_sphere(Random& random) {
  for (;;) {
    const glm::vec3 v(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1));
    const float l = glm::length(v);
    if (l > 0.1f && l < 1) return v / l;
  }
}

/// As CPUs walk, as GPUs do, and with a stack of one entry, which drops nearly all that waits.
std::vector<BvhForm> forms() { return {BvhForm::wide(), BvhForm::short_stack(), BvhForm::short_stack(1)}; }

/// One arithmetic on one triangle: the same distance in bits, of the same triangle unless two are equally far.
void expect_same_hits(const std::vector<TraceHit>& a, const std::vector<TraceHit>& b, const BvhForm& form) {
  int different = 0, tied = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    different += (a[i].triangle < 0) != (b[i].triangle < 0) || a[i].t != b[i].t;
    tied += a[i].triangle != b[i].triangle;
    if (a[i].triangle == b[i].triangle) different += a[i].u != b[i].u || a[i].v != b[i].v;
  }
  EXPECT_EQ(different, 0) << form.width << " wide, stack of " << form.stack;
  EXPECT_LE(tied, static_cast<int>(a.size()) / 500) << form.width << " wide, stack of " << form.stack;
}

/// Rays that start at random in a box; a share runs exactly along an axis.
void compare(const World& scene, const glm::vec3& low, const glm::vec3& high, int rays) {
  const Oracle oracle(scene.triangles);
  Random random(7);
  std::vector<float> points(3 * static_cast<std::size_t>(rays)), directions(points.size());
  std::vector<glm::vec3> o, d;
  for (int i = 0; i < rays; ++i) {
    o.push_back({random.between(low.x, high.x), random.between(low.y, high.y), random.between(low.z, high.z)});
    d.push_back(on_sphere(random));
    if (i % 10 == 0) d.back() = glm::vec3(i % 30 == 0, i % 30 == 10, i % 30 == 20) * (i % 20 ? -1.f : 1.f);
    for (int c = 0; c < 3; ++c) {
      points[static_cast<std::size_t>(c * rays + i)] = o.back()[c];
      directions[static_cast<std::size_t>(c * rays + i)] = d.back()[c];
    }
  }
  const auto hits_of = [&](const BvhForm& form) {
    return TraceScene(test_device(), scene, Precision::Single, form).hits(points, directions, 0, 1e9f);
  };
  const std::vector<TraceHit> hits = hits_of(BvhForm::wide());
  for (const BvhForm& form : forms()) expect_same_hits(hits_of(form), hits, form);
  int different = 0, hit_count = 0;
  for (int i = 0; i < rays; ++i) {
    const OracleHit expected = oracle.trace(o[static_cast<std::size_t>(i)], d[static_cast<std::size_t>(i)]);
    const TraceHit& found = hits[static_cast<std::size_t>(i)];
    hit_count += expected.triangle >= 0;
    // Positions are up to 8 m from the origin and each intersection sums a few products: 32 eps of that, more at
    // grazing incidence, where t is ill-conditioned; those are the rays that may differ.
    const float tolerance = 32 * 6e-8f * 8;
    const bool same = (found.triangle < 0) == (expected.triangle < 0) &&
                      std::abs(found.t - expected.t) <= tolerance * (1 + expected.t);
    different += !same;
    if (same && found.triangle == expected.triangle && found.triangle >= 0) {
      const Triangle& t = scene.triangles[static_cast<std::size_t>(found.triangle)];
      const glm::vec3 at = o[static_cast<std::size_t>(i)] + found.t * d[static_cast<std::size_t>(i)];
      const glm::vec3 by_weights =
          t.v[0].position * (1 - found.u - found.v) + t.v[1].position * found.u + t.v[2].position * found.v;
      EXPECT_LT(glm::length(at - by_weights), 1e-3f) << "ray " << i;
    }
  }
  ASSERT_GT(hit_count, rays / 10);
  // Rays that pass an edge within rounding may be seen on either side of it.
  EXPECT_LE(different, rays / 10000 + 1);
}

TEST(Bvh, EqualsEmbreeOnFurnishedRooms) {
  const RoomAssets assets = load_assets(std::string(CLERESTORY_SOURCE_DIR) + "/assets", Setting::Training);
  for (const std::uint64_t seed : {1u, 2u}) {
    const Room room = make_room(seed, Setting::Training, assets);
    compare(room.scene, glm::vec3(-room.size.x / 2, 0, -room.size.z / 2),
            glm::vec3(room.size.x / 2, room.size.y, room.size.z / 2), 40000);
  }
}

TEST(Bvh, EqualsEmbreeOnLooseTriangles) {
  World scene;
  scene.materials.push_back(plain(glm::vec3(0.5f), 0.5f));
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    const glm::vec3 at(random.between(-2, 2), random.between(-2, 2), random.between(-2, 2));
    Triangle t;
    for (Vertex& v : t.v) v.position = at + 0.3f * on_sphere(random);
    scene.triangles.push_back(t);
  }
  compare(scene, glm::vec3(-3), glm::vec3(3), 40000);
}

/// A closed ball of triangles that share their corners bit for bit: an octahedron whose faces are split `times` times.
World split_ball(const glm::vec3& center, float radius, int times) {
  std::vector<std::array<glm::vec3, 3>> faces;
  for (int i = 0; i < 8; ++i) {
    const float x = i & 1 ? -1.f : 1.f, y = i & 2 ? -1.f : 1.f, z = i & 4 ? -1.f : 1.f;
    faces.push_back({glm::vec3(x, 0, 0), {0, y, 0}, {0, 0, z}});
  }
  for (int k = 0; k < times; ++k) {
    std::vector<std::array<glm::vec3, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const glm::vec3 ab = glm::normalize(a + b), bc = glm::normalize(b + c), ca = glm::normalize(c + a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  World world;
  world.materials.push_back(plain(glm::vec3(0.5f), 1));
  for (const auto& face : faces) {
    Triangle& t = world.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) t.v[k].position = center + radius * face[k];
  }
  return world;
}

/// How many rays from o along d hit nothing, in all forms together.
std::int64_t misses(const World& scene, const std::vector<glm::vec3>& o, const std::vector<glm::vec3>& d) {
  std::vector<float> points, directions;
  for (int c = 0; c < 3; ++c) {
    for (const glm::vec3& v : o) points.push_back(v[c]);
    for (const glm::vec3& v : d) directions.push_back(v[c]);
  }
  std::int64_t count = 0;
  for (const BvhForm& form : forms()) {
    TraceScene traced(test_device(), scene, Precision::Single, form);
    const std::vector<TraceHit> hits = traced.hits(points, directions, 0, 1e9f);
    count += std::ranges::count_if(hits, [](const TraceHit& hit) { return hit.triangle < 0; });
  }
  return count;
}

/// Rays from points inside, a share of them close to the wall, to every corner, to points of every edge, and to points
/// a few units in the last place beside them: how many of them hit nothing.
std::int64_t leaks(const World& scene, const glm::vec3& center, float inside, int* rays) {
  Random random(9);
  std::vector<glm::vec3> o, d;
  for (const Triangle& t : scene.triangles)
    for (int k = 0; k < 3; ++k) {
      const glm::vec3 a = t.v[k].position, b = t.v[(k + 1) % 3].position;
      for (int i = 0; i < 12; ++i) {
        glm::vec3 target = a + (i == 0 ? 0.f : random.unit()) * (b - a);
        if (i % 3 == 2) target *= 1.f + std::numeric_limits<float>::epsilon() * random.between(-4, 4);
        o.push_back(center + inside * (i % 4 == 3 ? 0.999f : random.unit()) * on_sphere(random));
        d.push_back(target - o.back());
        if (i % 2) d.back() = glm::normalize(d.back());
      }
    }
  *rays = static_cast<int>(o.size());
  return misses(scene, o, d);
}

TEST(Bvh, ClosedMeshesDoNotLeakAtSharedEdges) {
  for (const glm::vec3& center : {glm::vec3(0), glm::vec3(3, -1, 40)})
    for (const int times : {0, 1, 5}) {
      int rays = 0;
      // The inner ball of an octahedron has 1 / sqrt(3) of its radius.
      EXPECT_EQ(leaks(split_ball(center, 2, times), center, 2 * (times < 5 ? 0.57f : 0.99f), &rays), 0)
          << times << " splits, " << rays << " rays";
    }
}

/// A square of 2 m in the plane x = 0, of cells whose edges run along axes, so that boxes of neighbours meet in them.
World grid(int cells) {
  World world;
  world.materials.push_back(plain(glm::vec3(0.5f), 1));
  const auto at = [&](int y, int z) {
    const auto place = [&](int k) { return -1 + 2 * static_cast<float>(k) / static_cast<float>(cells); };
    return glm::vec3(0, place(y), place(z));
  };
  Shapes shapes(world, glm::mat4(1), Random(1));
  for (int y = 0; y < cells; ++y)
    for (int z = 0; z < cells; ++z) shapes.quad(at(y, z), at(y + 1, z), at(y + 1, z + 1), at(y, z + 1), 0);
  return world;
}

/// From a hundred times their size away, where the rounding of a ray's origin is far above that of corners.
TEST(Bvh, MeshesDoNotLeakFromFarAway) {
  for (const World& scene : {split_ball(glm::vec3(0), 1, 4), grid(50)}) {
    Random random(4);
    std::vector<glm::vec3> o, d;
    for (const Triangle& t : scene.triangles)
      for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 10; ++i) {
          const glm::vec3 a = t.v[k].position, b = t.v[(k + 1) % 3].position, target = a + random.unit() * (b - a);
          const glm::vec3 away = i % 5 == 0 ? glm::vec3(1, 0, 0) : on_sphere(random);
          // Near the outline a ray may pass.
          if (glm::length(target - glm::dot(target, away) * away) > 0.9f || std::abs(away.x) < 0.1f) continue;
          if (std::max(std::abs(target.y), std::abs(target.z)) > 0.99f) continue;
          o.push_back(target + 100.f * away), d.push_back(target - o.back());
        }
    ASSERT_GT(o.size(), 30000u);
    EXPECT_EQ(misses(scene, o, d), 0) << scene.triangles.size() << " triangles";
  }
}

/// Solids of the rooms and of inserted objects too: their seams and poles share corners bit for bit.
TEST(Bvh, RoundSolidsDoNotLeakAtTheirSeams) {
  int rays = 0;
  World ball;
  ball.materials.push_back(plain(glm::vec3(0.5f), 1));
  Shapes(ball, glm::mat4(1), Random(1)).sphere({0.3f, 1, 0}, 0.5f, 0, 24);
  EXPECT_EQ(leaks(ball, {0.3f, 1, 0}, 0.49f, &rays), 0) << rays;
  World vase;
  vase.materials = ball.materials;
  Shapes(vase, glm::mat4(1), Random(1)).lathe({0, 0, 0}, {{0.3f, 0}, {0.6f, 0.5f}, {0, 1.2f}}, 0, 30);
  EXPECT_EQ(leaks(vase, {0, 0.45f, 0}, 0.3f, &rays), 0) << rays;
  World cushion;
  cushion.materials = ball.materials;
  Shapes(cushion, glm::mat4(1), Random(1)).cushion({-0.5f, 0, -0.4f}, {0.5f, 0.8f, 0.4f}, 0.2f, 0, 5);
  EXPECT_EQ(leaks(cushion, {0, 0.4f, 0}, 0.39f, &rays), 0) << rays;
  World mesh;
  mesh.materials = ball.materials;
  const Mesh sphere = sphere_mesh({0.1f, -0.2f, -2}, 0.7f, 32);
  for (const auto& corners : sphere.indices) {
    Triangle& t = mesh.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& p = sphere.positions[corners[k]];
      t.v[k].position = {p[0], p[1], p[2]};
    }
  }
  EXPECT_EQ(leaks(mesh, {0.1f, -0.2f, -2}, 0.69f, &rays), 0) << rays;
}

TEST(Bvh, OneTriangle) {
  World scene;
  scene.materials.push_back(plain(glm::vec3(0.5f), 0.5f));
  Triangle t;
  t.v[0].position = {0, 0, -1}, t.v[1].position = {1, 0, -1}, t.v[2].position = {0, 1, -1};
  scene.triangles.push_back(t);
  for (const BvhForm& form : forms()) {
    TraceScene traced(test_device(), scene, Precision::Single, form);
    const auto hit = traced.hits({0.25f, 0.9f, 0.25f, 0.9f, 0, 0}, {0, 0, 0, 0, -2, -2}, 0, 10);
    EXPECT_EQ(hit[0].triangle, 0);
    EXPECT_FLOAT_EQ(hit[0].t, 0.5f);
    EXPECT_FLOAT_EQ(hit[0].u, 0.25f);
    EXPECT_FLOAT_EQ(hit[0].v, 0.25f);
    EXPECT_EQ(hit[1].triangle, -1);
  }
}

/// Paths of the same random numbers in a furnished room with panes: shadows and bounces meet the same triangles.
TEST(Bvh, PathsDoNotDependOnTheForm) {
  const RoomAssets assets = load_assets(std::string(CLERESTORY_SOURCE_DIR) + "/assets", Setting::Training);
  const Room room = make_room(2, Setting::Training, assets);
  Camera camera = Camera::from_fov(61, 45, 70);  // neither is a multiple of a work-group's size
  look_at(camera, {0.1, 1.5, 0.2}, {0.8, 1.0, -0.9});
  TraceScene wide(test_device(), room.scene, Precision::Single, BvhForm::wide());
  const std::vector<float> want = wide.picture(camera, 4, 3, 6).mean.data, depth = wide.maps(camera).depth.data;
  for (const BvhForm& form : forms()) {
    TraceScene scene(test_device(), room.scene, Precision::Single, form);
    const std::vector<float> got = scene.picture(camera, 4, 3, 6).mean.data;
    int different = 0;
    for (std::size_t i = 0; i < got.size(); ++i)
      different += std::abs(got[i] - want[i]) > 1e-4f * (std::abs(want[i]) + 1e-3f);
    EXPECT_LE(different, static_cast<int>(got.size()) / 500) << form.width << " wide, stack of " << form.stack;
    EXPECT_EQ(scene.maps(camera).depth.data, depth) << form.width << " wide, stack of " << form.stack;
    EXPECT_EQ(scene.picture(camera, 4, 3, 6).mean.data, got) << "the same bits, " << form.width << " wide";
  }
}

TEST(Bvh, DepthAndSizeOfAShortStacksTreeAreBounded) {
  const Room room = make_box_room(5);
  const Bvh tree = build_bvh(room.scene.triangles, BvhForm::short_stack());
  EXPECT_EQ(tree.children.size() % 4, 0u);
  EXPECT_EQ(tree.planes.size(), 6 * tree.children.size());
  EXPECT_GT(tree.depth, build_bvh(room.scene.triangles, BvhForm::wide()).depth);
  EXPECT_LE(tree.depth, 32);
}

TEST(Bvh, WhatIsNotANumberHitsNothing) {
  TraceScene scene(test_device(), make_box_room(1).scene),
      with_short_stack(test_device(), make_box_room(1).scene, Precision::Single, BvhForm::short_stack());
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, inf, -inf})
    for (int part = 0; part < 6; ++part) {
      std::vector<float> point{0, 1, 0}, direction{0.3f, 0.4f, -0.5f};
      (part < 3 ? point : direction)[static_cast<std::size_t>(part % 3)] = bad;
      for (TraceScene* traced : {&scene, &with_short_stack}) {
        EXPECT_EQ(traced->hits(point, direction, 0, 1e30f).front().triangle, -1) << bad << " in part " << part;
        for (const float l : traced->radiance(point, direction, {})) EXPECT_EQ(l, 0) << bad << " in part " << part;
      }
    }
}

TEST(Bvh, RefusesNothingAndNonsense) {
  EXPECT_THROW(build_bvh({}, BvhForm::wide()), Error);
  Triangle t;
  t.v[0].position.x = std::nanf("");
  EXPECT_THROW(build_bvh({t}, BvhForm::wide()), Error);
}

TEST(Bvh, SameTreeEveryTime) {
  const Room room = make_box_room(5);
  for (const BvhForm& form : forms()) {
    const Bvh a = build_bvh(room.scene.triangles, form), b = build_bvh(room.scene.triangles, form);
    EXPECT_EQ(a.planes, b.planes);
    EXPECT_EQ(a.children, b.children);
    EXPECT_EQ(a.triangles, b.triangles);
  }
}

}  // namespace
}  // namespace clerestory
