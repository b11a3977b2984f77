// Generated rooms: closed, lit, varied, and held-out content kept apart.
#include "tracer/room.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "checks/trace/reference.hpp"
#include "tests/roundings.hpp"
#include "tests/tracer/scenes.hpp"
#include "tracer/balls.hpp"
#include "tracer/probes.hpp"
#include "tracer/sky.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

const RoomAssets& assets_of(Setting setting) {
  static const RoomAssets training = load_assets(std::string(CLERESTORY_SOURCE_DIR) + "/assets", Setting::Training);
  static const RoomAssets held_out = load_assets(std::string(CLERESTORY_SOURCE_DIR) + "/assets", Setting::HeldOut);
  return setting == Setting::Training ? training : held_out;
}

bool has(const Room& room, const std::string& furniture) {
  for (const Occupied& o : room.occupied) {
    if (o.name == furniture) return true;
  }
  return false;
}

TEST(Room, TrainingNeverShowsWhatIsHeldOut) {
  for (const NamedPanorama& p : assets_of(Setting::Training).panoramas) {
    for (const std::string& held : kHeldOutPanoramas) EXPECT_NE(p.name, held);
  }
  for (const Model& m : assets_of(Setting::Training).models) EXPECT_NE(m.name, kHeldOutModel);
  ASSERT_FALSE(assets_of(Setting::Training).models.empty());
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Room room = make_room(seed, Setting::Training, assets_of(Setting::Training));
    EXPECT_FALSE(has(room, kHeldOutFurniture)) << seed;
    for (const Material& m : room.scene.materials) {
      ASSERT_NE(m.texture, static_cast<float>(kHeldOutTexture)) << seed;
    }
  }
}

TEST(Room, HeldOutRoomsShowIt) {
  int beds = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const Room room = make_room(seed, Setting::HeldOut, assets_of(Setting::HeldOut));
    EXPECT_NE(std::find(kHeldOutPanoramas.begin(), kHeldOutPanoramas.end(), room.panorama), kHeldOutPanoramas.end());
    int stone = 0, panes = 0;
    for (const Triangle& t : room.scene.triangles) {
      stone +=
          room.scene.materials[static_cast<std::size_t>(t.material)].texture == static_cast<float>(kHeldOutTexture);
      panes += t.emitter >= 0 && room.scene.emitters[static_cast<std::size_t>(t.emitter)].panorama;
    }
    EXPECT_GT(stone, 10) << seed;
    EXPECT_GT(panes, 0) << seed;
    beds += has(room, kHeldOutFurniture);
  }
  EXPECT_GE(beds, 25) << "small rooms may have no wall for a bed, most have";
}

TEST(Room, SeedsDifferAndRepeat) {
  const RoomAssets& assets = assets_of(Setting::Training);
  const Room a = make_room(4, Setting::Training, assets), again = make_room(4, Setting::Training, assets);
  ASSERT_EQ(a.scene.triangles.size(), again.scene.triangles.size());
  for (std::size_t i = 0; i < a.scene.triangles.size(); ++i) {
    ASSERT_EQ(a.scene.triangles[i].v[0].position, again.scene.triangles[i].v[0].position);
  }
  std::set<std::string> kinds;
  std::set<std::size_t> sizes;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const Room room = make_room(seed, Setting::Training, assets);
    kinds.insert(room.kind);
    sizes.insert(room.scene.triangles.size());
    bool emits = false;
    for (const Triangle& t : room.scene.triangles) emits |= t.emitter >= 0;
    EXPECT_TRUE(emits) << seed;
  }
  EXPECT_GE(kinds.size(), 4u);
  EXPECT_EQ(sizes.size(), 30u);
}

bool inside(const Floor& f, float x0, float z0, float x1, float z1, float margin) {
  return x0 >= f.x0 - margin && z0 >= f.z0 - margin && x1 <= f.x1 + margin && z1 <= f.z1 + margin;
}

TEST(Room, FurnitureStaysInsideAndApart) {
  std::set<std::string> pieces;
  int recesses = 0;
  for (const Setting setting : {Setting::Training, Setting::HeldOut})
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      const Room room = make_room(seed, setting, assets_of(setting));
      recesses += room.floors.size() > 1;
      for (std::size_t i = 0; i < room.occupied.size(); ++i) {
        const Occupied& a = room.occupied[i];
        pieces.insert(a.name);
        EXPECT_TRUE(std::ranges::any_of(
            room.floors,
            [&](const Floor& f) { return inside(f, a.x0, a.z0, a.x1, a.z1, 1e-3f) && a.height <= f.height; }))
            << seed << " " << a.name;
        for (std::size_t k = 0; k < i; ++k) {
          const Occupied& b = room.occupied[k];
          EXPECT_FALSE(a.x1 > b.x0 && a.x0 < b.x1 && a.z1 > b.z0 && a.z0 < b.z1)
              << seed << " " << a.name << " in " << b.name;
        }
      }
    }
  EXPECT_GE(pieces.size(), 30u);
  EXPECT_GT(recesses, 10) << "rooms that are no rectangles";
}

TEST(Room, NothingSticksOutOfTheWalls) {
  // Windows, doors and niches reach into the walls, up to half a metre.
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Room room = make_room(seed, Setting::Training, assets_of(Setting::Training));
    for (const Triangle& t : room.scene.triangles)
      for (const Vertex& v : t.v) {
        const glm::vec3& p = v.position;
        ASSERT_TRUE(
            std::ranges::any_of(room.floors, [&](const Floor& f) { return inside(f, p.x, p.z, p.x, p.z, 0.51f); }))
            << seed << ": " << p.x << " " << p.y << " " << p.z;
        ASSERT_GE(p.y, -0.03f) << seed << ": feet of slanted legs only";
        ASSERT_LE(p.y, room.size.y * (1 + 8 * kFloatRounding)) << seed;
      }
  }
}

TEST(Room, CamerasStandInFreeSpace) {
  int compared = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const Room room = make_room(seed, Setting::Training, assets_of(Setting::Training));
    TraceScene scene(test_device(), room.scene);
    for (const Camera& camera : choose_views(scene, room, 2, 32, 24, Random(seed))) {
      const Vec3 eye = camera.position();
      compared += static_cast<int>(room.occupied.size());
      for (const Occupied& o : room.occupied)
        EXPECT_FALSE(eye.x > static_cast<double>(o.x0) && eye.x < static_cast<double>(o.x1) &&
                     eye.z > static_cast<double>(o.z0) && eye.z < static_cast<double>(o.z1) &&
                     eye.y < static_cast<double>(o.height))
            << seed << ": in a " << o.name;
    }
  }
  EXPECT_GT(compared, 12 * 2) << "of two views in each room";
}

TEST(Room, OutsideDiffersFromRoomToRoom) {
  std::set<std::string> outside;
  int skies = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Room room = make_room(seed, Setting::Training, assets_of(Setting::Training));
    outside.insert(room.panorama), skies += sky_seed(room.panorama) || sunny_seed(room.panorama);
  }
  EXPECT_GE(outside.size(), 36u);
  EXPECT_GE(skies, 30);
  EXPECT_LE(skies, 54) << "photographed panoramas are still seen";
}

// A quarter of training rooms is wild; what training alone shows is not among what is held out.
TEST(Room, HeldOutRoomsKeepTheirOwnLooks) {
  int wild = 0, prints = 0, smudged = 0;
  constexpr int count = 200;
  for (std::uint64_t seed = 0; seed < count; ++seed) {
    const Room room = make_room(seed, Setting::Training, assets_of(Setting::Training));
    wild += room.content == Content::Wild;
    for (const Material& m : room.scene.materials) {
      prints += m.texture == static_cast<float>(Texture::Print), smudged += m.smudge != 0;
      ASSERT_GE(std::min({m.roughness_a, m.roughness_b, m.roughness_c}) - std::abs(m.smudge), 0.02f) << seed;
    }
    if (seed >= 30) continue;
    const Room kept = make_room(seed, Setting::HeldOut, assets_of(Setting::HeldOut));
    EXPECT_EQ(kept.content, Content::HeldOut);
    for (const Part& part : kept.parts) EXPECT_LE(part.kind, PartKind::Tube) << seed;
    for (const Material& m : kept.scene.materials) {
      EXPECT_NE(m.texture, static_cast<float>(Texture::Print)) << seed;
      EXPECT_EQ(m.smudge, 0);
      EXPECT_EQ(m.stain, 0);
    }
  }
  EXPECT_NEAR(wild, kWildRooms * count, 3 * std::sqrt(count * kWildRooms * (1 - kWildRooms)));  // 3 deviations
  EXPECT_GT(prints, 10 * count);
  EXPECT_GT(smudged, 10 * count);
}

TEST(Palette, WallsAreMostlyMatt) {
  int matt = 0, polished = 0, printed = 0;
  constexpr int count = 600;
  for (int seed = 0; seed < count; ++seed) {
    const Material m = Palette(Random(static_cast<std::uint64_t>(seed)), Content::Varied).wall();
    matt += m.roughness_a >= 0.5f, polished += m.roughness_a < 0.3f;
    printed += m.texture == static_cast<float>(Texture::Rug) || m.texture == static_cast<float>(Texture::Fabric) ||
               m.texture == static_cast<float>(Texture::Painting) || m.texture == static_cast<float>(Texture::Print);
  }
  EXPECT_GT(matt, 0.88 * count);
  EXPECT_LT(polished, 0.05 * count);
  EXPECT_GT(printed, 0.1 * count);
  EXPECT_LT(printed, 0.25 * count);
}

TEST(Room, MapsAreCompleteAndInRange) {
  for (const Setting setting : {Setting::Training, Setting::HeldOut}) {
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      const Room room = make_room(seed, setting, assets_of(setting));
      TraceScene scene(test_device(), room.scene);
      for (const Camera& camera : choose_views(scene, room, 2, 64, 48, Random(seed))) {
        const TraceMaps maps = scene.maps(camera);
        const std::size_t n = maps.depth.pixels();
        std::size_t away = 0;
        for (std::size_t i = 0; i < n; ++i) {
          ASSERT_GT(maps.depth.data[i], 0) << "the room has a hole, seed " << seed << " pixel " << i;
          ASSERT_LT(maps.depth.data[i], 10);
          const Vec3 normal(maps.normal.data[i], maps.normal.data[n + i], maps.normal.data[2 * n + i]);
          ASSERT_NEAR(glm::length(normal), 1, 8 * kFloatRounding);
          const Vec3 d = camera.direction(static_cast<int>(i) % 64 + 0.5, static_cast<int>(i) / 64 + 0.5);
          away += glm::dot(normal, d) >= 0;
          const float limit = maps.metallic.data[i] > 0 ? 0.92f : 0.78f;
          for (std::size_t c = 0; c < 3; ++c) {
            ASSERT_GE(maps.albedo.data[c * n + i], 0.02f) << seed;
            ASSERT_LE(maps.albedo.data[c * n + i], limit * (1 + 4 * kFloatRounding));
          }
          ASSERT_GE(maps.roughness.data[i], 0.02f);
          ASSERT_LE(maps.roughness.data[i], 1);
        }
        EXPECT_LT(away, n / 100) << "smooth normals face away at silhouettes only";
        EXPECT_GE(camera.fov_degrees(), 35 * (1 - 4 * kFloatRounding));
        EXPECT_LE(camera.fov_degrees(), 120 * (1 + 4 * kFloatRounding));
        const Vec3 eye = camera.position();
        EXPECT_GE(eye.y, 0.9 * (1 - 2 * kFloatRounding));
        EXPECT_LE(eye.y, 1.8 * (1 + 2 * kFloatRounding));
      }
    }
  }
}

TEST(Room, DepthIsAxial) {
  // An empty box of 4 x 2.5 x 4 m, seen along -z from its middle: the far wall is 2 m away in every pixel that sees it.
  World scene;
  Shapes shapes(scene, glm::mat4(1), Random(1));
  shapes.box({-2, 0, -2}, {2, 2.5f, 2}, shapes.material(plain(glm::vec3(0.5f), 0.5f)));
  TraceScene traced(test_device(), scene);
  Camera camera = Camera::from_fov(40, 30, 80);
  look_at(camera, {0, 1.25, 0}, {0, 1.25, -1});
  const TraceMaps maps = traced.maps(camera);
  int wall = 0;
  for (std::size_t i = 0; i < maps.depth.pixels(); ++i) {
    if (maps.normal.data[2 * maps.depth.pixels() + i] < 0.5f) continue;
    ++wall;
    EXPECT_NEAR(maps.depth.data[i], 2, 16 * 2 * kFloatRounding);
  }
  EXPECT_GT(wall, 600);
}

/// Directional albedo of the model at a cosine of incidence, by the reference's quadrature.
double directional_albedo(double albedo, double roughness, double metallic, double cosine) {
  const reference::Brdf brdf{reference::V(albedo), roughness, metallic};
  const reference::V wo(std::sqrt(1 - cosine * cosine), 0, cosine);
  return reference::over_hemisphere([&](const reference::V& wi) { return brdf(wi, wo).x * wi.z; });
}

TEST(Room, BrightestMaterialsReflectAtMost95Percent) {
  // The caps of kernels/trace/texture.clh, at the roughness of lacquer and above; up to 70 degrees.
  for (const double roughness : {0.25, 0.5, 1.0}) {
    for (const double cosine : {1.0, 0.8, 0.6, 0.35}) {
      EXPECT_LT(directional_albedo(0.78, roughness, 0, cosine), 0.95) << roughness << " " << cosine;
      EXPECT_LT(directional_albedo(0.92, roughness, 1, cosine), 0.95) << roughness << " " << cosine;
    }
  }
}

// What is asked for changes nothing else: a level view across the room is the same camera as before.
TEST(Views, AreRolledAndCloseAsAskedFor) {
  const Room room = make_room(1, Setting::Training, assets_of(Setting::Training));
  TraceScene scene(test_device(), room.scene);
  constexpr int count = 40;
  const auto views = [&](const Handling& handling) {
    return choose_views(scene, room, count, 32, 24, Random(1), handling);
  };
  const auto roll_of = [](const Camera& camera) {  // of the right axis out of the horizon; the pitch is small
    return std::asin(camera.camera_to_world[4]) * 180 / std::numbers::pi;
  };
  const auto pitch_of = [](const Camera& camera) { return std::asin(-camera.camera_to_world[6]); };  // looks along -z
  const auto median_depth = [&](const Camera& camera) {
    std::vector<float> depth = scene.maps(camera).depth.data;
    std::nth_element(depth.begin(), depth.begin() + static_cast<std::ptrdiff_t>(depth.size() / 2), depth.end());
    return depth[depth.size() / 2];
  };
  const auto level = views({}), rolled = views({.roll = 5}), mixed = views({.close_ups = 0.25}),
             above = views({.from_above = 0.25}), both = views({.close_ups = 0.25, .from_above = 0.75});
  int turned = 0, nearer = 0, same = 0, down = 0;
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_EQ(roll_of(level[i]), 0);
    EXPECT_LE(std::abs(roll_of(rolled[i])), 5);
    turned += std::abs(roll_of(rolled[i])) > 1;
    rolled[i].check("rolled");  // a rigid motion still
    const bool kept = mixed[i].camera_to_world == level[i].camera_to_world;
    same += kept;
    nearer += !kept && median_depth(mixed[i]) < 2.2f;
    const bool looks_down = above[i].camera_to_world != level[i].camera_to_world;
    down += looks_down;
    // From 1.4 m at what is at most 0.8 m high and 3 m away.
    EXPECT_TRUE(!looks_down || pitch_of(above[i]) < -std::atan(0.6 / 3)) << i;
    EXPECT_EQ(both[i].camera_to_world == mixed[i].camera_to_world, !kept) << i;
    EXPECT_NE(both[i].camera_to_world, level[i].camera_to_world) << i;
  }
  EXPECT_GT(turned, count / 4);
  EXPECT_LT(turned, 3 * count / 4);
  EXPECT_EQ(same + nearer, count);
  EXPECT_GE(nearer, 4);  // of 40 at a quarter: fewer one time in 200
  EXPECT_LE(nearer, 18);
  EXPECT_GE(down, 4);
  EXPECT_LE(down, 18);
}

TEST(Balls, RestInTheOpenAndAreSeen) {
  const Room room = make_room(1, Setting::Training, assets_of(Setting::Training));
  TraceScene scene(test_device(), room.scene);
  int placed = 0;
  for (const Camera& camera : choose_views(scene, room, 4, 80, 60, Random(1))) {
    const auto place = place_ball(scene, room.scene, camera, Random(2));
    if (!place) continue;
    ++placed;
    EXPECT_GE(distance_to_surface(room.scene, camera.to_world(place->center)), place->radius);
    TraceScene with(test_device(), with_ball(room.scene, camera, *place, ball_kinds()[0]));
    const TraceMaps before = scene.maps(camera), after = with.maps(camera);
    const auto at = camera.project(place->center);
    ASSERT_TRUE(at);
    const std::size_t i = static_cast<std::size_t>(at->y) * 80 + static_cast<std::size_t>(at->x);
    EXPECT_LE(after.depth.data[i], before.depth.data[i]);
    int changed = 0;
    for (std::size_t k = 0; k < before.depth.pixels(); ++k) changed += before.depth.data[k] != after.depth.data[k];
    EXPECT_GT(changed, 10);
    EXPECT_LT(changed, 80 * 60 / 4);
    if (after.depth.data[i] < before.depth.data[i]) {
      EXPECT_FLOAT_EQ(after.roughness.data[i], 0.02f);
      EXPECT_EQ(after.metallic.data[i], 1);
      // The ray to the centre meets the ball a radius before it, to the facets' 2e-3 and half a pixel.
      const double nearest = -place->center.z * (1 - place->radius / glm::length(place->center));
      EXPECT_NEAR(static_cast<double>(after.depth.data[i]), nearest, 0.03 * place->radius);
    }
  }
  EXPECT_GE(placed, 2);
}

}  // namespace
}  // namespace clerestory
