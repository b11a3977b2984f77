// Environment maps against closed boxes of known light, an integral equation, and the tracer's own pictures.
#include "tracer/envmaps.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "checks/trace/reference.hpp"
#include "tests/tracer/colored_box.hpp"
#include "tests/tracer/scenes.hpp"
#include "tracer/room.hpp"

namespace clerestory {
namespace {

// Estimates are compared at 4.5 standard errors: seven in a million would fail by chance, and seeds are fixed.
constexpr double kSigmas = 4.5;

Camera camera_at(const Vec3& eye, const Vec3& target, int width = 40, int height = 30) {
  Camera camera = Camera::from_fov(width, height, 75);
  look_at(camera, eye, target);
  return camera;
}

Envmaps envmaps_of(TraceScene& scene, const World& world, const Camera& camera, const RadianceQuery& query) {
  return trace_envmaps(scene, world, camera, scene.maps(camera), query);
}

/// Point and unit normal that a tile's pixel shows, camera space.
struct Seen {
  Vec3 position, normal;
};

Seen seen_by(const TraceMaps& maps, const Camera& camera, const EnvmapLayout& layout, int column, int row) {
  const int x = layout.pixel_x(column), y = layout.pixel_y(row);
  const Vec3 n(maps.normal.at(0, y, x), maps.normal.at(1, y, x), maps.normal.at(2, y, x));
  return {camera.unproject(x + 0.5, y + 0.5, static_cast<double>(maps.depth.at(0, y, x))), glm::normalize(n)};
}

TEST(Envmaps, ShowTheWallThatEachDirectionMeets) {
  const World world = colored_box();
  TraceScene scene(test_device(), world);
  RadianceQuery query;
  query.max_depth = 0;  // emission only: no noise
  // Level, so that the floor's normal in camera space is (0, 1, 0), the frame's other branch; and tilted and turned.
  for (const Camera& camera :
       {camera_at({0.2, 1.1, 1.2}, {0.1, 1.1, -2}, 160, 120), camera_at({-0.9, 1.6, -0.8}, {0.7, 0.2, 0.9}, 48, 64)}) {
    const TraceMaps maps = scene.maps(camera);
    const Envmaps envmaps = trace_envmaps(scene, world, camera, maps, query);
    ASSERT_EQ(envmaps.layout.columns, camera.width > camera.height ? 40 : 30);
    int poles = 0, compared = 0;
    for (int row = 0; row < envmaps.layout.rows; ++row)
      for (int column = 0; column < envmaps.layout.columns; ++column) {
        const Seen seen = seen_by(maps, camera, envmaps.layout, column, row);
        const Frame frame = hemisphere_frame(seen.normal);
        poles += std::abs(seen.normal.y) > 0.999;
        for (int elevation = 0; elevation < envmap_elevations; ++elevation)
          for (int azimuth = 0; azimuth < envmap_azimuths; ++azimuth) {
            const Vec3 d = envmap_direction(frame, column, row, azimuth, elevation);
            const BoxHit hit = hit_in_colored_box(camera.to_world(seen.position), camera.direction_to_world(d));
            if (hit.margin < 1e-3) continue;  // beside an edge of the box either wall may be met
            ++compared;
            const std::array<float, 3> l = envmaps.at(column, row, azimuth, elevation);
            for (int c = 0; c < 3; ++c) ASSERT_EQ(l[static_cast<std::size_t>(c)], hit.radiance[c]);
          }
      }
    EXPECT_GT(compared, 0.98 * 1200 * 128);
    EXPECT_EQ(poles > 100, camera.width > camera.height);
  }
}

TEST(Envmaps, FurnaceOfAClosedSphere) {
  const World world = furnace(plain(glm::vec3(0.7f), 0.6f));
  TraceScene scene(test_device(), world);
  RadianceQuery query;
  query.max_depth = 0;
  const Camera camera = camera_at({0.3, -0.2, 0.1}, {0.1, 0.4, -1});
  const auto used = [](const Vec3& local) {
    // Facets stand off the sphere: what starts flatter than the angle between a facet and the smooth normal, 2 pi / 80
    // at most, may leave through the facet itself.
    return local.z > 0.1;
  };
  Envmaps envmaps = envmaps_of(scene, world, camera, query);
  const auto each_texel = [&](const auto& visit) {
    for (int row = 0; row < envmaps.layout.rows; ++row)
      for (int column = 0; column < envmaps.layout.columns; ++column)
        for (int elevation = 0; elevation < envmap_elevations; ++elevation)
          for (int azimuth = 0; azimuth < envmap_azimuths; ++azimuth) {
            const Vec3 local = envmap_direction(column, row, azimuth, elevation);
            if (used(local)) visit(elevation, local.z, envmaps.at(column, row, azimuth, elevation)[0]);
          }
  };
  each_texel([](int, double, float l) { ASSERT_EQ(l, 1.f); });  // every wall emits 1

  query.max_depth = kMaxDepth, query.seed = 3;
  envmaps = envmaps_of(scene, world, camera, query);
  // With reflections: a chord meets the sphere at equal angles on both ends, so radiance depends on the local z alone.
  const reference::Furnace expected({reference::V(0.7), 0.6, 0});
  struct Row {
    double sum = 0, squares = 0, wanted = 0;
    int count = 0;
  };
  std::array<Row, envmap_elevations> rows;
  each_texel([&](int elevation, double z, float l) {
    Row& r = rows[static_cast<std::size_t>(elevation)];
    const double difference = static_cast<double>(l) - expected.at(z);
    r.sum += difference, r.squares += difference * difference, r.wanted += expected.at(z), ++r.count;
  });
  for (const Row& r : rows) {
    ASSERT_GT(r.count, 5000);
    const double mean = r.sum / r.count, error = std::sqrt((r.squares / r.count - mean * mean) / (r.count - 1));
    // 2e-3: facets are chords of the sphere, a permille shorter.
    EXPECT_NEAR(mean, 0, kSigmas * error + 2e-3 * r.wanted / r.count);
    EXPECT_LT(error, 0.02 * r.wanted / r.count) << "the test could see nothing";
  }
}

TEST(Envmaps, IntegrateToTheTracersPicture) {
  const World world = plain_room();
  TraceScene scene(test_device(), world);
  const Camera camera = camera_at({1.5, 1.5, 1.6}, {-0.4, 0.8, -0.6});  // 40 x 30: each pixel has a tile
  const TraceMaps maps = scene.maps(camera);
  RadianceQuery query;
  query.spp = 4, query.seed = 8;
  const Envmaps envmaps = trace_envmaps(scene, world, camera, maps, query);
  const TracePicture picture = scene.picture(camera, 256, 9);
  double sum[3] = {0, 0, 0}, squares[3] = {0, 0, 0}, light[3] = {0, 0, 0};
  int tiles = 0;
  for (int row = 0; row < 30; ++row)
    for (int column = 0; column < 40; ++column) {
      if (maps.emitter[static_cast<std::size_t>(row * 40 + column)] >= 0) continue;
      ++tiles;
      const Seen seen = seen_by(maps, camera, envmaps.layout, column, row);
      const reference::Brdf brdf{
          {maps.albedo.at(0, row, column), maps.albedo.at(1, row, column), maps.albedo.at(2, row, column)},
          static_cast<double>(maps.roughness.at(0, row, column)),
          static_cast<double>(maps.metallic.at(0, row, column))};
      const Vec3 wo = hemisphere_frame(seen.normal).to_local(-glm::normalize(seen.position));
      Vec3 reflected(0);
      for (int elevation = 0; elevation < envmap_elevations; ++elevation)
        for (int azimuth = 0; azimuth < envmap_azimuths; ++azimuth) {
          const Vec3 wi = envmap_direction(column, row, azimuth, elevation);
          const std::array<float, 3> l = envmaps.at(column, row, azimuth, elevation);
          reflected += brdf(wi, wo) * Vec3(l[0], l[1], l[2]) * (wi.z * envmap_solid_angle(elevation));
        }
      for (int c = 0; c < 3; ++c) {
        const double difference = reflected[c] - static_cast<double>(picture.mean.at(c, row, column));
        sum[c] += difference, squares[c] += difference * difference;
        light[c] += static_cast<double>(picture.mean.at(c, row, column));
      }
    }
  ASSERT_GT(tiles, 1000);
  for (int c = 0; c < 3; ++c) {
    const double mean = sum[c] / tiles, error = std::sqrt((squares[c] / tiles - mean * mean) / (tiles - 1));
    EXPECT_LT(std::abs(mean), kSigmas * error) << "channel " << c;
    EXPECT_LT(error, 0.01 * light[c] / tiles) << "the test could not see a hundredth";
  }
}

TEST(Envmaps, TexturesAreAveragedOverAPixelsAngle) {
  const World world = tiled_wall_before_lamp();
  TraceScene scene(test_device(), world);
  RadianceQuery query;
  query.max_depth = 1, query.light_samples = 0, query.spp = 16;
  // The glowing wall is seen, and the tiles opposite shine on it. Pixels of 2.2 and of 0.02 degrees: 15 cm of the
  // tiles, 2 cm each, and 2 mm.
  const auto spread = [&](double fov) {
    Camera camera = Camera::from_fov(40, 30, fov);
    look_at(camera, {0, 0, 0}, {0, 0, 1});
    const Envmaps envmaps = envmaps_of(scene, world, camera, query);
    std::vector<double> facing;
    for (int row = 14; row < 16; ++row)
      for (int column = 18; column < 22; ++column)
        for (int azimuth = 0; azimuth < envmap_azimuths; ++azimuth)
          facing.push_back(static_cast<double>(envmaps.at(column, row, azimuth, 0)[0]));
    return relative_spread(facing);
  };
  EXPECT_LT(spread(75), 0.3);
  EXPECT_GT(spread(1), 0.6);
}

TEST(Envmaps, TilesWithoutASurfaceAreZero) {
  World world;
  Shapes shapes(world, glm::mat4(1), Random(1));
  const int floor = shapes.material(plain(glm::vec3(0.5f), 1)), lamp = shapes.emitter({glm::vec3(2), false});
  shapes.quad({-50, 0, 50}, {50, 0, 50}, {50, 0, -50}, {-50, 0, -50}, floor);
  shapes.quad({-50, 9, -50}, {50, 9, -50}, {50, 9, 10}, {-50, 9, 10}, floor, lamp);  // behind the camera and above
  TraceScene scene(test_device(), world);
  const Camera camera = camera_at({0, 1, 20}, {0, 1, 30});
  const TraceMaps maps = scene.maps(camera);
  const Envmaps envmaps = trace_envmaps(scene, world, camera, maps, {});
  int empty = 0;
  double lit = 0;
  for (int row = 0; row < 30; ++row)
    for (int column = 0; column < 40; ++column) {
      const bool none = maps.depth.at(0, row, column) <= 0;
      empty += none;
      for (int elevation = 0; elevation < envmap_elevations; ++elevation)
        for (int azimuth = 0; azimuth < envmap_azimuths; ++azimuth) {
          const float l = envmaps.at(column, row, azimuth, elevation)[1];
          ASSERT_TRUE(!none || l == 0) << l;
          lit += static_cast<double>(l);
        }
    }
  EXPECT_GT(empty, 300);
  EXPECT_LT(empty, 900);
  EXPECT_GT(lit, 0);
}

TEST(Envmaps, SameSeedSameBitsAndABoundOnlyDarkens) {
  const Room room = make_box_room(2);
  TraceScene a(test_device(), room.scene), b(test_device(), room.scene);
  const Camera camera = camera_at({1.5, 1.5, 1.5}, {0, 0.8, 0});
  RadianceQuery query;
  query.spp = 2, query.seed = 5;
  const Envmaps first = envmaps_of(a, room.scene, camera, query), again = envmaps_of(b, room.scene, camera, query);
  EXPECT_EQ(first.radiance.data, again.radiance.data);
  query.most_indirect = 1e30f;
  EXPECT_EQ(envmaps_of(a, room.scene, camera, query).radiance.data, first.radiance.data);
  query.most_indirect = 0.05f;
  const Envmaps bound = envmaps_of(a, room.scene, camera, query);
  int darker = 0;
  for (std::size_t i = 0; i < bound.radiance.data.size(); ++i) {
    EXPECT_LE(bound.radiance.data[i], first.radiance.data[i]);
    darker += bound.radiance.data[i] < first.radiance.data[i];
  }
  EXPECT_GT(darker, 1000);
  query.seed = 6;
  EXPECT_NE(envmaps_of(a, room.scene, camera, query).radiance.data, bound.radiance.data);
}

}  // namespace
}  // namespace clerestory
