// Probes: where they stand, which way up they are, and that they hold the tracer's radiance.
#include "tracer/probes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "host/math/panorama.hpp"
#include "tests/tracer/colored_box.hpp"
#include "tests/tracer/scenes.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

constexpr double kSigmas = 4.5;

Vec3 random_point(Random& random, float size) {
  return {random.between(-size, size), random.between(-size, size), random.between(-size, size)};
}

TEST(Probes, DistanceToATriangle) {
  Random random(4);
  for (int i = 0; i < 60; ++i) {
    World world;
    world.triangles.emplace_back();
    Vec3 corner[3];
    for (int k = 0; k < 3; ++k) {
      // Every fifth has no area: a segment. Points on all sides, near and far.
      corner[k] = k == 2 && i % 5 == 0 ? corner[0] : random_point(random, 1);
      world.triangles[0].v[k].position = glm::vec3(corner[k]);
      corner[k] = Vec3(world.triangles[0].v[k].position);
    }
    const Vec3 point = random_point(random, i % 2 ? 3 : 0.7f);
    constexpr int steps = 300;
    double nearest = 1e9;
    for (int a = 0; a <= steps; ++a)
      for (int b = 0; a + b <= steps; ++b) {
        const double u = static_cast<double>(a) / steps, v = static_cast<double>(b) / steps;
        nearest = std::min(nearest,
                           glm::length(corner[0] + u * (corner[1] - corner[0]) + v * (corner[2] - corner[0]) - point));
      }
    const double side = std::max(
        {glm::length(corner[1] - corner[0]), glm::length(corner[2] - corner[0]), glm::length(corner[2] - corner[1])});
    const double found = distance_to_surface(world, point);
    EXPECT_LE(found, nearest + 1e-12);
    EXPECT_GE(found, nearest - side / steps) << "the grid's nearest point is at most a step away";
  }
}

TEST(Probes, StandInFreeAir) {
  const RoomAssets assets = load_assets(std::string(CLERESTORY_SOURCE_DIR) + "/assets", Setting::Training);
  int placed = 0, visible = 0;
  for (const std::uint64_t seed : {3u, 8u, 21u}) {
    const Room room = make_room(seed, Setting::Training, assets);
    TraceScene scene(test_device(), room.scene);
    for (const Camera& camera : choose_views(scene, room, 2, 80, 60, Random(seed))) {
      const TraceMaps maps = scene.maps(camera);
      const std::vector<Probe> probes = place_probes(scene, room.scene, camera, maps, 8, Random(5));
      EXPECT_GE(probes.size(), 7u);
      for (const Probe& probe : probes) {
        ++placed, visible += probe.visible;
        EXPECT_GE(probe.distance, kProbeClearance);
        const glm::vec3 at(camera.to_world(probe.center));
        EXPECT_LT(std::abs(at.x), room.size.x / 2);
        EXPECT_LT(std::abs(at.z), room.size.z / 2);
        EXPECT_GT(at.y, 0);
        EXPECT_LT(at.y, room.size.y);

        // Rays all around: nothing is nearer than stated, and nearly everything shows its front. Inside furniture all
        // would be backs. Fronts are missing where a rug's or a leaf's back is seen.
        constexpr int rays = 2000;
        std::vector<float> directions(3 * rays);
        for (int i = 0; i < rays; ++i) {
          const double z = 1 - (2 * i + 1.0) / rays, r = std::sqrt(1 - z * z), a = 2.399963 * i;
          const double d[3] = {r * std::cos(a), z, r * std::sin(a)};
          for (int c = 0; c < 3; ++c) directions[static_cast<std::size_t>(c * rays + i)] = static_cast<float>(d[c]);
        }
        const std::vector<TraceHit> hits = scene.hits(repeated(at, rays), directions, 0, 1e9f);
        int fronts = 0;
        float nearest = 1e9f;
        for (int i = 0; i < rays; ++i) {
          const TraceHit& hit = hits[static_cast<std::size_t>(i)];
          ASSERT_GE(hit.triangle, 0) << "the room is closed";
          nearest = std::min(nearest, hit.t);
          const Triangle& t = room.scene.triangles[static_cast<std::size_t>(hit.triangle)];
          const glm::vec3 n = glm::cross(t.v[1].position - t.v[0].position, t.v[2].position - t.v[0].position);
          fronts += n.x * directions[static_cast<std::size_t>(i)] +
                        n.y * directions[static_cast<std::size_t>(rays + i)] +
                        n.z * directions[static_cast<std::size_t>(2 * rays + i)] <
                    0;
        }
        EXPECT_GE(nearest, probe.distance * (1 - 1e-4));
        // 2000 rays are some 4.5 degrees apart: a wall at distance d is met within 1 % of d, an edge or a corner later.
        EXPECT_LE(nearest, 1.5 * probe.distance);
        EXPECT_GT(fronts, 0.8 * rays);

        const std::optional<Vec2> pixel = camera.project(probe.center);
        const bool inside =
            pixel && pixel->x >= 0 && pixel->y >= 0 && pixel->x < camera.width && pixel->y < camera.height;
        if (probe.visible) {
          ASSERT_TRUE(inside);
          const float depth = maps.depth.at(0, static_cast<int>(pixel->y), static_cast<int>(pixel->x));
          EXPECT_LT(-probe.center.z, static_cast<double>(depth));
        } else if (inside) {
          const float depth = maps.depth.at(0, static_cast<int>(pixel->y), static_cast<int>(pixel->x));
          EXPECT_GE(-probe.center.z, static_cast<double>(depth));
        }
      }
      // The first ones are the same however many are asked for.
      const std::vector<Probe> two = place_probes(scene, room.scene, camera, maps, 2, Random(5));
      for (std::size_t k = 0; k < two.size(); ++k) EXPECT_EQ(two[k].center, probes[k].center);
    }
  }
  EXPECT_GT(visible, 0.6 * placed);
  EXPECT_LT(visible, placed) << "some stand out of view";
}

TEST(Probes, NoPlaceNoProbe) {
  World world;
  Shapes shapes(world, glm::mat4(1), Random(1));
  shapes.box({-0.2f, 0, -0.2f}, {0.2f, 0.25f, 0.2f}, shapes.material(plain(glm::vec3(0.5f), 1)));
  turn_inside_out(world);
  TraceScene scene(test_device(), world);
  Camera camera = Camera::from_fov(20, 15, 70);
  look_at(camera, {0, 0.12, 0.1}, {0, 0.12, -1});
  EXPECT_TRUE(place_probes(scene, world, camera, scene.maps(camera), 3, Random(1)).empty());
}

TEST(Probes, PanoramasAreInCameraAxesTheRightWayUp) {
  TraceScene scene(test_device(), colored_box());
  Camera camera = Camera::from_fov(40, 30, 70);
  look_at(camera, {0.3, 1.4, 1.2}, {-0.6, 0.9, -1});
  RadianceQuery query;
  query.max_depth = 0;  // emission only: no noise
  Probe probe;
  probe.center = {0.2, -0.1, -0.8};
  trace_probe(scene, camera, probe, query);
  ASSERT_EQ(probe.radiance.width, probe_width);
  ASSERT_EQ(probe.radiance.height, probe_height);
  int compared = 0;
  for (int y = 0; y < probe_height; ++y)
    for (int x = 0; x < probe_width; ++x) {
      const Vec3 d = panorama_direction(x, y, probe_width, probe_height);
      const BoxHit hit = hit_in_colored_box(camera.to_world(probe.center), camera.direction_to_world(d));
      if (hit.margin < 1e-4) continue;
      ++compared;
      for (int c = 0; c < 3; ++c) ASSERT_EQ(probe.radiance.at(c, y, x), hit.radiance[c]) << x << " " << y;
    }
  EXPECT_GT(compared, 8000);
  // In words: the camera looks down a little at the far wall, so that wall is in the middle, the ceiling on top.
  EXPECT_EQ(probe.radiance.at(2, 31, 64), color_of_wall(2, false).z);
  EXPECT_EQ(probe.radiance.at(1, 0, 64), color_of_wall(1, true).y);
  EXPECT_EQ(probe.radiance.at(0, 31, 96), color_of_wall(0, true).x) << "the right quarter looks to the right";
}

// The variance that two estimates state, beside that of the mean over seeds.
TEST(Probes, TheVarianceOfTwoEstimatesIsThatOfTheirMean) {
  TraceScene scene(test_device(), colored_box());
  Camera camera = Camera::from_fov(40, 30, 70);
  look_at(camera, {0.3, 1.4, 1.2}, {-0.6, 0.9, -1});
  constexpr int kSeeds = 10;
  std::vector<double> sum, squares;
  double stated = 0, seen = 0;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    Probe probe;
    probe.center = {0.2, -0.1, -0.8};
    const Image variance = trace_probe_twice(scene, camera, probe, {.spp = 2}, {2 * seed + 1, 2 * seed + 2});
    sum.resize(variance.data.size()), squares.resize(variance.data.size());
    for (std::size_t i = 0; i < variance.data.size(); ++i) {
      const double x = static_cast<double>(probe.radiance.data[i]);
      sum[i] += x, squares[i] += x * x, stated += static_cast<double>(variance.data[i]) / kSeeds;
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) seen += (squares[i] - sum[i] * sum[i] / kSeeds) / (kSeeds - 1);
  ASSERT_GT(seen, 0);
  EXPECT_NEAR(stated / seen, 1, 0.1);  // 24,576 values, of each nine degrees of freedom
}

// Rays are traced in blocks; equal rays of two of them have numbers of their own.
TEST(Probes, RaysOfAnotherBlockShareNoRandomNumbers) {
  TraceScene scene(test_device(), colored_box());
  const std::size_t count = 32768 + 1;
  const std::vector<Vec3> points(count, Vec3(0, 1, 0)), directions(count, glm::normalize(Vec3(0.3, -0.2, -1)));
  const std::vector<float> radiance = scene.radiance(planar(points), planar(directions), {.spp = 2, .seed = 3});
  EXPECT_NE(radiance[0], radiance[1]) << "noise";
  EXPECT_NE(radiance[0], radiance[count - 1]);
}

TEST(Probes, TexturesAreAveragedOverATexel) {
  TraceScene scene(test_device(), tiled_wall_before_lamp());
  RadianceQuery query;
  query.max_depth = 1, query.light_samples = 0, query.spp = 64;
  Probe probe;
  probe.center = {0, 0, -0.27};  // 1.73 m before the tiles a texel is four and a quarter of them wide
  trace_probe(scene, Camera::from_fov(40, 30, 70), probe, query);
  std::vector<double> averaged, points;
  std::vector<float> directions;
  for (int y = 28; y < 36; ++y)
    for (int x = 60; x < 68; ++x) averaged.push_back(static_cast<double>(probe.radiance.at(0, y, x)));
  for (int c = 0; c < 3; ++c)
    for (int y = 28; y < 36; ++y)
      for (int x = 60; x < 68; ++x)
        directions.push_back(static_cast<float>(panorama_direction(x, y, probe_width, probe_height)[c]));
  const std::vector<float> at_points = scene.radiance(repeated(glm::vec3(probe.center), 64), directions, query);
  for (std::size_t i = 0; i < 64; ++i) points.push_back(static_cast<double>(at_points[i]));
  EXPECT_LT(relative_spread(averaged), 0.2);
  EXPECT_GT(relative_spread(points), 0.5) << "points see tiles or joints";
}

TEST(Probes, HoldTheTracersRadiance) {
  TraceScene scene(test_device(), plain_room());
  Camera camera = Camera::from_fov(40, 30, 70);
  look_at(camera, {1.5, 1.5, 1.5}, {0, 0.8, 0});
  RadianceQuery query;
  query.spp = 48, query.seed = 7;
  Probe probe;
  probe.center = {0.1, 0.2, -1.2};
  trace_probe(scene, camera, probe, query);
  double sum = 0, variance = 0, light = 0;
  for (int i = 0; i < 24; ++i) {
    const int x = (i * 53 + 5) % probe_width, y = (i * 29 + 3) % probe_height;
    RadianceQuery one;
    one.seed = 100 + static_cast<std::uint32_t>(i);
    one.spread = 2 * std::numbers::pi_v<float> / probe_width;
    const Vec3 d = camera.direction_to_world(panorama_direction(x, y, probe_width, probe_height));
    const Estimate e = estimate(scene, glm::vec3(camera.to_world(probe.center)), glm::vec3(d), 6000, one);
    // Channels of a texel vary as one: their mean.
    const double expected = (e.mean[0] + e.mean[1] + e.mean[2]) / 3, error = (e.error[0] + e.error[1] + e.error[2]) / 3;
    const double found =
        (static_cast<double>(probe.radiance.at(0, y, x)) + static_cast<double>(probe.radiance.at(1, y, x)) +
         static_cast<double>(probe.radiance.at(2, y, x))) /
        3;
    const double both = error * std::sqrt(1 + 6000.0 / query.spp);
    EXPECT_NEAR(found, expected, 2 * kSigmas * both + 1e-6)
        << x << " " << y;  // one texel's mean of 48 is not yet normal
    sum += found - expected, variance += both * both, light += expected;
  }
  EXPECT_LT(std::abs(sum), kSigmas * std::sqrt(variance));
  EXPECT_LT(std::sqrt(variance), 0.05 * light) << "the test could see nothing";
}

}  // namespace
}  // namespace clerestory
