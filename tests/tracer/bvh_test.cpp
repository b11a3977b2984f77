// Traversal against Embree's own, which is the oracle here and nowhere else.
#include "tracer/bvh.hpp"

#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "tests/tracer/scenes.hpp"
#include "tracer/room.hpp"

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

/// Rays that start at random in a box; a share runs exactly along an axis.
void compare(const World& scene, const glm::vec3& low, const glm::vec3& high, int rays) {
  const Oracle oracle(scene.triangles);
  TraceScene traced(test_device(), scene);
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
  const std::vector<TraceHit> hits = traced.hits(points, directions, 0, 1e9f);
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

TEST(Bvh, OneTriangle) {
  World scene;
  scene.materials.push_back(plain(glm::vec3(0.5f), 0.5f));
  Triangle t;
  t.v[0].position = {0, 0, -1}, t.v[1].position = {1, 0, -1}, t.v[2].position = {0, 1, -1};
  scene.triangles.push_back(t);
  TraceScene traced(test_device(), scene);
  const auto hit = traced.hits({0.25f, 0.9f, 0.25f, 0.9f, 0, 0}, {0, 0, 0, 0, -2, -2}, 0, 10);
  EXPECT_EQ(hit[0].triangle, 0);
  EXPECT_FLOAT_EQ(hit[0].t, 0.5f);
  EXPECT_FLOAT_EQ(hit[0].u, 0.25f);
  EXPECT_FLOAT_EQ(hit[0].v, 0.25f);
  EXPECT_EQ(hit[1].triangle, -1);
}

TEST(Bvh, WhatIsNotANumberHitsNothing) {
  TraceScene scene(test_device(), make_box_room(1).scene);
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, inf, -inf})
    for (int part = 0; part < 6; ++part) {
      std::vector<float> point{0, 1, 0}, direction{0.3f, 0.4f, -0.5f};
      (part < 3 ? point : direction)[static_cast<std::size_t>(part % 3)] = bad;
      EXPECT_EQ(scene.hits(point, direction, 0, 1e30f).front().triangle, -1) << bad << " in part " << part;
      for (const float l : scene.radiance(point, direction, {})) EXPECT_EQ(l, 0) << bad << " in part " << part;
    }
}

TEST(Bvh, RefusesNothingAndNonsense) {
  EXPECT_THROW(build_bvh({}), Error);
  Triangle t;
  t.v[0].position.x = std::nanf("");
  EXPECT_THROW(build_bvh({t}), Error);
}

TEST(Bvh, SameTreeEveryTime) {
  const Room room = make_box_room(5);
  const Bvh a = build_bvh(room.scene.triangles), b = build_bvh(room.scene.triangles);
  EXPECT_EQ(a.planes, b.planes);
  EXPECT_EQ(a.children, b.children);
  EXPECT_EQ(a.triangles, b.triangles);
}

}  // namespace
}  // namespace clerestory
