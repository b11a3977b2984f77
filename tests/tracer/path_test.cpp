// The path tracer against closed forms and quadrature.
#include <gtest/gtest.h>

#include "checks/trace/path_reference.hpp"
#include "host/math/panorama.hpp"
#include "tests/roundings.hpp"
#include "tests/tracer/scenes.hpp"
#include "tracer/room.hpp"

namespace clerestory {
namespace {

// Estimates are compared at 4.5 standard errors: seven in a million would fail by chance, and seeds are fixed.
constexpr double kSigmas = 4.5;

TEST(Path, FurnaceOfAClosedSphere) {
  struct Case {
    float albedo, roughness, metallic;
  };
  // The last one loses next to nothing: weights of directions exceed 1, and paths live to the end.
  for (const Case& c : {Case{0.7f, 1.f, 0}, Case{0.4f, 0.5f, 0}, Case{0.8f, 0.6f, 1}, Case{1.f, 0.6f, 1}}) {
    TraceScene scene(test_device(), furnace(plain(glm::vec3(c.albedo), c.roughness, c.metallic)));
    const reference::Furnace expected({reference::V(static_cast<double>(c.albedo)), static_cast<double>(c.roughness),
                                       static_cast<double>(c.metallic)},
                                      kMaxDepth);
    for (const float off : {0.f, 1.f, 1.6f}) {
      // From (off, 0, 0) straight up: the wall is met at sine off / 2.
      RadianceQuery query;
      query.seed = 5;
      const Estimate e = estimate(scene, {off, 0.f, 0.01f}, {0, 1, 0}, 20000, query);
      const double wanted = expected.at(std::sqrt(1 - off * off / 4));
      // Facets stand off the sphere by up to 2 (1 - cos(pi / 80)) = 1.5e-3 m: chords differ by a permille.
      EXPECT_NEAR(e.mean[0], wanted, kSigmas * e.error[0] + 2e-3 * wanted)
          << c.albedo << " " << c.roughness << " " << off;
    }
  }
}

struct LampScene {
  World scene;
  reference::Brdf brdf;
};

/// A floor under a square lamp of half a metre at one metre, nothing else.
LampScene floor_and_lamp(float roughness, float metallic) {
  LampScene s;
  Shapes shapes(s.scene, glm::mat4(1), Random(1));
  const int floor = shapes.material(plain({0.6f, 0.4f, 0.2f}, roughness, metallic));
  const int lamp = shapes.emitter({{3, 2, 1}, false});
  shapes.quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, floor);
  shapes.quad({-0.25f, 1, -0.25f}, {0.25f, 1, -0.25f}, {0.25f, 1, 0.25f}, {-0.25f, 1, 0.25f}, floor, lamp);
  s.brdf = {{0.6f, 0.4f, 0.2f}, static_cast<double>(roughness), static_cast<double>(metallic)};
  return s;
}

/// Light reflected from floor point x towards wo (world, y up), by summing over the lamp's area.
reference::V reflected(const reference::Brdf& brdf, const reference::V& x, const reference::V& wo) {
  constexpr int n = 600;
  reference::V sum(0);
  const auto local = [](const reference::V& v) { return reference::V(v.x, -v.z, v.y); };  // y up becomes z up
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < n; ++k) {
      const reference::V at(-0.25 + 0.5 * (i + 0.5) / n, 1, -0.25 + 0.5 * (k + 0.5) / n);
      const reference::V d = at - x;
      const double d2 = glm::dot(d, d);
      const reference::V wi = d / std::sqrt(d2);
      sum += brdf(local(wi), local(wo)) * reference::V(3, 2, 1) * (wi.y * wi.y / d2);
    }
  }
  return sum * (0.25 / (n * n));
}

TEST(Path, DirectLightEqualsQuadrature) {
  for (const float metallic : {0.f, 1.f}) {
    for (const float roughness : {0.25f, 0.5f, 1.f}) {
      LampScene s = floor_and_lamp(roughness, metallic);
      TraceScene scene(test_device(), s.scene);
      const glm::vec3 point(0.3f, 0, 0.2f), wo = glm::normalize(glm::vec3(-0.4f, 0.8f, 0.3f));
      const reference::V expected = reflected(s.brdf, point, wo);
      for (const int light_samples : {0, 1, 3}) {
        RadianceQuery query;
        query.max_depth = 1, query.light_samples = light_samples, query.seed = 11;
        const Estimate e = estimate(scene, point + 0.5f * wo, -wo, 60000, query);
        for (int c = 0; c < 3; ++c) {
          ASSERT_GT(e.mean[c], 0);
          // 1e-3: the offset of rays, 0.1 mm in a metre, and the midpoint rule.
          EXPECT_NEAR(e.mean[c], expected[c], kSigmas * e.error[c] + 1e-3 * expected[c])
              << "roughness " << roughness << " metallic " << metallic << " light samples " << light_samples;
        }
      }
    }
  }
}

TEST(Path, EmittersCanBeLeftOut) {
  LampScene s = floor_and_lamp(0.5f, 0);
  TraceScene scene(test_device(), s.scene);
  RadianceQuery with, without;
  without.emitters = false;
  with.max_depth = without.max_depth = 0;
  EXPECT_FLOAT_EQ(static_cast<float>(estimate(scene, {0, 0.5f, 0}, {0, 1, 0}, 4, with).mean[0]), 3.f);
  EXPECT_EQ(estimate(scene, {0, 0.5f, 0}, {0, 1, 0}, 4, without).mean[0], 0);
  EXPECT_EQ(estimate(scene, {0, 1.5f, 0}, {0, -1, 0}, 4, with).mean[0], 0) << "the back of a lamp is dark";
}

/// A room whose light comes through one pane from a panorama with a bright spot, and from a lamp.
World room_with_pane() {
  World scene;
  Shapes shapes(scene, glm::mat4(1), Random(1));
  const int wall = shapes.material(plain({0.6f, 0.6f, 0.5f}, 0.6f)),
            shiny = shapes.material(plain(glm::vec3(0.7f), 0.3f, 1));
  shapes.box({-2, 0, -2}, {2, 2.5f, 2}, wall);
  turn_inside_out(scene);
  shapes.box({-1.2f, 0, -1.2f}, {-0.4f, 0.9f, -0.5f}, shiny);
  const int pane = shapes.emitter({glm::vec3(1), true}), lamp = shapes.emitter({glm::vec3(4), false});
  shapes.quad({-1, 0.8f, -1.99f}, {1, 0.8f, -1.99f}, {1, 2, -1.99f}, {-1, 2, -1.99f}, wall, pane);
  shapes.quad({-0.4f, 2.49f, -0.4f}, {0.4f, 2.49f, -0.4f}, {0.4f, 2.49f, 0.4f}, {-0.4f, 2.49f, 0.4f}, wall, lamp);
  scene.panorama = {64, 32, std::vector<float>(64 * 32 * 3, 0.5f)};
  for (int c = 0; c < 3; ++c) scene.panorama.rgb[static_cast<std::size_t>(3 * (15 * 64 + 34) + c)] = 60;
  scene.panorama_turn = 0.1f;
  return scene;
}

TEST(Path, LightSamplingAgreesWithDirectionsOnly) {
  TraceScene scene(test_device(), room_with_pane());
  Camera camera = Camera::from_fov(24, 18, 80);
  look_at(camera, {1.2, 1.4, 1.6}, {-0.3, 0.9, -1});
  const TracePicture a = scene.picture(camera, 768, 1, kMaxDepth, 2), b = scene.picture(camera, 768, 2, kMaxDepth, 0);
  EXPECT_EQ(a.dropped.count + b.dropped.count, 0);
  int far = 0;
  double sum_a = 0, sum_b = 0, variance = 0;
  for (std::size_t i = 0; i < a.mean.data.size(); ++i) {
    const double v = static_cast<double>(a.variance.data[i]) + static_cast<double>(b.variance.data[i]);
    far += std::abs(static_cast<double>(a.mean.data[i] - b.mean.data[i])) > 3 * std::sqrt(v) + 1e-6;
    sum_a += static_cast<double>(a.mean.data[i]), sum_b += static_cast<double>(b.mean.data[i]), variance += v;
  }
  // Three sigmas hold 99.7 % of normal values; directions alone find the bright spot seldom, which skews theirs.
  EXPECT_LT(far, static_cast<int>(0.02 * static_cast<double>(a.mean.data.size())));
  // Channels of a pixel are fully correlated: three times the variance at most.
  EXPECT_NEAR(sum_a, sum_b, kSigmas * std::sqrt(3 * variance));
}

TEST(Path, PanesShowThePanorama) {
  const World scene = room_with_pane();
  TraceScene traced(test_device(), scene);
  Camera camera = Camera::from_fov(96, 72, 70);
  look_at(camera, {0.2, 1.4, 1.6}, {0, 1.4, -2});
  const TraceMaps maps = traced.maps(camera);
  int shown = 0, spots = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * camera.width + x;
      if (maps.emitter[i] != 0) continue;
      ++shown;
      Vec3 d = camera.direction_to_world(camera.direction(x + 0.5, y + 0.5));
      const double a = scene.panorama_turn;  // the panorama is turned: look the direction up that far to the right
      d = {std::cos(a) * d.x - std::sin(a) * d.z, d.y, std::sin(a) * d.x + std::cos(a) * d.z};
      const Vec2 uv = panorama_position(d);
      const double px = uv.x * 64 - 34.5, py = uv.y * 32 - 15.5;  // from the bright pixel's centre
      const double weight = std::max(0.0, 1 - std::abs(px)) * std::max(0.0, 1 - std::abs(py));
      spots += weight > 0.5;
      // atan2 and acos to a few ulp, times 64 columns, times the step of 59.5 between pixels.
      EXPECT_NEAR(static_cast<double>(maps.emission.data[i]), 0.5 + 59.5 * weight, 5e-3) << x << " " << y;
    }
  }
  EXPECT_GT(shown, 200);
  EXPECT_GT(spots, 0);
}

/// A closed room with a lamp, a pane before an uneven sky, a metal block and a coarse ball with smooth normals.
World plain_room_with_pane() {
  World scene = plain_room();
  Shapes shapes(scene, glm::mat4(1), Random(1));
  shapes.box({0.3f, 0, -1.4f}, {0.9f, 0.7f, -0.8f}, shapes.material(plain({0.9f, 0.7f, 0.4f}, 0.6f, 1)));
  shapes.sphere({0.9f, 0.5f, 0.3f}, 0.5f, shapes.material(plain({0.4f, 0.6f, 0.8f}, 0.7f)), 5);
  const int pane = shapes.emitter({{1, 0.9f, 0.8f}, true});
  shapes.quad({-1.99f, 0.8f, 1}, {-1.99f, 0.8f, -1}, {-1.99f, 2, -1}, {-1.99f, 2, 1}, 0, pane);
  scene.panorama = {16, 8, {}};
  for (int i = 0; i < 16 * 8 * 3; ++i) scene.panorama.rgb.push_back(1.f + static_cast<float>(i * 5 % 7));
  scene.panorama_turn = 0.4f;
  return scene;
}

// Pictures, and radiance along their rays, are what an independent path tracer finds in double: through a camera of
// oblong pixels that looks off its middle, by one scattering and by four.
TEST(Path, PicturesAndRadianceEqualAnIndependentPathTracer) {
  const World world = plain_room_with_pane();
  TraceScene scene(test_device(), world);
  const reference::PathTracer reference(world);
  Camera camera = Camera::from_fov(10, 8, 80);
  camera.fy = 1.6 * camera.fx, camera.cx -= 1, camera.cy += 1.5;
  look_at(camera, {1.5, 1.6, 1.7}, {-0.2, 0.8, -0.7});
  constexpr int pixels = 10 * 8, paths = 1200;
  std::vector<float> points(3 * pixels, 0.f), directions(points.size());
  for (int i = 0; i < pixels; ++i) {
    const Vec3 d = camera.ray(i % 10 + 0.5, i / 10 + 0.5);
    for (int c = 0; c < 3; ++c) directions[static_cast<std::size_t>(c * pixels + i)] = static_cast<float>(d[c]);
  }
  for (const int depth : {1, 4}) {
    RadianceQuery query;
    query.spp = 2048, query.seed = 4, query.light_samples = 1, query.max_depth = depth;
    query.to_world = camera.camera_to_world;
    const std::vector<float> radiance = scene.radiance(points, directions, query);
    const TracePicture picture = scene.picture(camera, query.spp, 3, depth, 2);
    Random random(31);
    int far = 0;
    double sum = 0, of_picture = 0, of_radiance = 0, doubt = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      const int x = static_cast<int>(i % 10), y = static_cast<int>(i / 10);
      const Vec3 d = camera.direction_to_world(camera.direction(x + 0.5, y + 0.5));
      reference::V mean(0), squares(0);
      for (int k = 0; k < paths; ++k) {
        const reference::V l = reference.radiance({1.5, 1.6, 1.7}, d, depth, random) / static_cast<double>(paths);
        mean += l, squares += l * l;
      }
      for (std::size_t c = 0; c < 3; ++c) {
        const double expected = mean[static_cast<int>(c)];
        // Sums over paths: the square of the mean is a share 1 / paths of the squares.
        const double v = std::max(0.0, squares[static_cast<int>(c)] - expected * expected / paths);
        const double p = static_cast<double>(picture.mean.data[c * pixels + i]),
                     r = static_cast<double>(radiance[c * pixels + i]),
                     noise = static_cast<double>(picture.variance.data[c * pixels + i]);
        // Directly seen light is the same number: 1e-4 for a panorama read in float. One light sample is at most twice
        // as uncertain as two.
        far += std::abs(p - expected) > 3.5 * std::sqrt(v + noise) + 1e-4 * expected;
        far += std::abs(r - expected) > 3.5 * std::sqrt(v + 2 * noise) + 1e-4 * expected;
        sum += expected, of_picture += p, of_radiance += r, doubt += v + 2 * noise;
      }
    }
    // Half a permille of normal values lie beyond 3.5 sigmas; the host's paths have longer tails.
    EXPECT_LE(far, 5) << "depth " << depth << " of " << 6 * pixels;
    const double sigma = std::sqrt(3 * doubt);  // channels vary as one
    EXPECT_NEAR(of_picture, sum, kSigmas * sigma) << depth;
    EXPECT_NEAR(of_radiance, sum, kSigmas * sigma) << depth;
    EXPECT_LT(sigma, 0.005 * sum) << "what this resolves";
  }
}

/// A row of pixels that looks along -y.
Camera looking_down(const glm::vec3& eye, int width) {
  Camera camera = Camera::from_fov(width, 1, 1);
  camera.set_pose(Mat3(Vec3(1, 0, 0), Vec3(0, 0, -1), Vec3(0, 1, 0)), Vec3(eye));
  return camera;
}

// A lamp that is seen has no noise: neither many samples nor squares of large numbers make any.
TEST(Path, WhatHasNoNoiseHasNoVarianceAndIsAsBrightAsItIs) {
  for (const float radiance : {0.1f, 0.7f, 100.f}) {
    World world;
    Shapes shapes(world, glm::mat4(1), Random(1));
    shapes.quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}, shapes.material(plain(glm::vec3(0.8f), 1)),
                shapes.emitter({glm::vec3(radiance), false}));
    TraceScene scene(test_device(), world);
    RadianceQuery query;
    query.light_samples = 0, query.max_depth = 0, query.spp = 65536;
    const glm::vec3 eye(0, 0.5f, 0), down(0, -1, 0);
    EXPECT_FLOAT_EQ(scene.radiance(repeated(eye, 1), repeated(down, 1), query)[0], radiance);
    const Camera camera = looking_down(eye, 1);
    const TracePicture picture = scene.picture(camera, 1000, 3, 0, 0);
    EXPECT_FLOAT_EQ(picture.mean.data[0], radiance);
    EXPECT_LT(picture.variance.data[0], std::pow(radiance * 0x1p-24f, 2)) << "but for the roundings of a pass's mean";
  }
}

// Sums of many samples keep their digits where the first one is a firefly: a mirror a little rough sees a lamp of
// radiance 0.7, by one of some hundred directions another of 3e4. The picture's passes are summed in double.
TEST(Path, AFireflyThatComesFirstTakesNoDigitsOfTheOthers) {
  World world;
  Shapes shapes(world, glm::mat4(1), Random(1));
  const int mirror = shapes.material(plain(glm::vec3(1), 0.1f, 1));
  shapes.quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, mirror);
  const auto lamp = [&](float low, float high, float radiance) {
    const int e = shapes.emitter({glm::vec3(radiance), false});
    shapes.quad({low, 1, -5}, {high, 1, -5}, {high, 1, 5}, {low, 1, 5}, mirror, e);
  };
  lamp(-5, 0.2f, 0.7f), lamp(0.2f, 0.3f, 3e4f);
  TraceScene scene(test_device(), world);
  const glm::vec3 eye(0, 0.5f, 0), down(0, -1, 0);
  RadianceQuery query;
  query.light_samples = 0, query.max_depth = 1, query.spp = 1;
  const auto seen = [&] { return scene.radiance(repeated(eye, 1), repeated(down, 1), query)[0]; };
  while (seen() < 1e4f) ASSERT_LT(++query.seed, 100000u);
  query.spp = 16384;
  const Camera camera = looking_down(eye, 1);
  const float passes = scene.picture(camera, query.spp, query.seed, 1, 0).mean.data[0];
  EXPECT_LT(passes, 100) << "few fireflies";
  EXPECT_NEAR(seen(), passes, 4 * 0x1p-24f * passes);
}

/// A floor of which one half sees a lamp of radiance 1, the other one that the sum over channels cannot hold.
TEST(Path, DroppedSamplesAreLeftOutOfTheMean) {
  World world;
  Shapes shapes(world, glm::mat4(1), Random(1));
  const int floor = shapes.material(plain(glm::vec3(0.8f), 1));
  shapes.quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, floor);
  const auto lamp = [&](float low, float high, float radiance) {
    const int e = shapes.emitter({glm::vec3(radiance), false});
    shapes.quad({low, 1, -3}, {high, 1, -3}, {high, 1, 3}, {low, 1, 3}, floor, e);
  };
  lamp(-3, 0, std::numeric_limits<float>::max()), lamp(0, 3, 1);
  TraceScene scene(test_device(), world);

  RadianceQuery query;
  query.light_samples = 0, query.max_depth = 1, query.spp = 32, query.seed = 6;
  constexpr int rays = 3000;
  const glm::vec3 eye(0, 0.5f, 0), down(0, -1, 0);
  DroppedSamples dropped;
  const std::vector<float> l = scene.radiance(repeated(eye, rays), repeated(down, rays), query, &dropped);
  double sum = 0, squares = 0;
  for (int i = 0; i < rays; ++i) sum += static_cast<double>(l[static_cast<std::size_t>(i)]);
  for (int i = 0; i < rays; ++i)
    squares += std::pow(static_cast<double>(l[static_cast<std::size_t>(i)]) - sum / rays, 2);
  const double share = static_cast<double>(dropped.count) / (rays * query.spp);
  EXPECT_GT(share, 0.35);
  EXPECT_LT(share, 0.55);
  // What is kept comes from directions that do not meet the bright lamp.
  const reference::Brdf brdf{reference::V(0.8), 1, 0};
  const double lit = reference::over_hemisphere([&](const reference::V& wi) {
    const bool met = wi.x > 0 && wi.x < 3 * wi.z && std::abs(wi.y) < 3 * wi.z;
    return met ? brdf(wi, {0, 0, 1}).x * wi.z : 0.0;
  });
  const double expected = lit / (1 - share);
  // The share is of 96,000 samples; its doubt is a sixth of a percent.
  EXPECT_NEAR(sum / rays, expected, kSigmas * std::sqrt(squares) / rays + 0.008 * expected);

  const Camera camera = looking_down(eye, 2);
  const TracePicture picture = scene.picture(camera, 20000, 6, 1, 0);
  EXPECT_NEAR(static_cast<double>(picture.dropped.count) / 40000, share,
              kSigmas * std::sqrt(share * (1 - share) * (1 / 40000.0 + 1 / 96000.0)));
  EXPECT_NEAR(static_cast<double>(picture.mean.data[0]), expected,
              kSigmas * std::sqrt(static_cast<double>(picture.variance.data[0])) + 0.008 * expected);

  // The first dropped sample is named: with the ones before it nothing is dropped, with it one.
  const auto drops = [&](int spp) {
    query.spp = spp;
    scene.radiance(repeated(eye, 1), repeated(down, 1), query, &dropped);
    return dropped;
  };
  const DroppedSamples first = drops(64);
  ASSERT_GT(first.count, 0);
  EXPECT_EQ(first.pixel, 0);
  EXPECT_EQ(drops(first.sample + 1).count, 1);
  if (first.sample > 0) {
    EXPECT_EQ(drops(first.sample).count, 0);
  }
  // So is one of a picture's later passes.
  World rarely;
  Shapes few(rarely, glm::mat4(1), Random(1));
  few.quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, few.material(plain(glm::vec3(0.8f), 1)));
  few.quad({-0.02f, 1, -3}, {0, 1, -3}, {0, 1, 3}, {-0.02f, 1, 3}, 0,
           few.emitter({glm::vec3(std::numeric_limits<float>::max()), false}));
  TraceScene narrow(test_device(), rarely);
  const Camera one = looking_down(eye, 1);
  std::uint32_t seed = 1;
  const auto dropped_of = [&](int spp) { return narrow.picture(one, spp, seed, 1, 0).dropped; };
  while (dropped_of(64).count > 0) ++seed;
  const DroppedSamples late = dropped_of(6400);
  ASSERT_GT(late.count, 1);
  ASSERT_GE(late.sample, 64);
  EXPECT_EQ(dropped_of(late.sample).count, 0);
  EXPECT_EQ(dropped_of(late.sample + 1).count, 1);
  // Nothing kept: no light, and no NaN.
  query.seed = 0;
  while (drops(1).count == 0) ++query.seed;
  EXPECT_EQ(scene.radiance(repeated(eye, 1), repeated(down, 1), query)[0], 0);
}

/// From within a smooth ball its normals, which point outwards, are turned to the viewer.
TEST(Path, SmoothNormalsLookBackFromInside) {
  World world;
  Shapes shapes(world, glm::mat4(1), Random(1));
  shapes.sphere({0.2f, 1, -0.3f}, 0.8f, shapes.material(plain(glm::vec3(0.5f), 1)), 24);
  TraceScene scene(test_device(), world);
  Camera camera = Camera::from_fov(24, 18, 100);
  look_at(camera, {0.2, 1, -0.3}, {1, 1.2, 0});
  const TraceMaps maps = scene.maps(camera);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 normal(maps.normal.at(0, y, x), maps.normal.at(1, y, x), maps.normal.at(2, y, x));
      // Normals blended over a facet of pi / 24 radians are within a permille of the sphere's.
      EXPECT_LT(glm::dot(normal, camera.direction(x + 0.5, y + 0.5)), -0.999) << x << " " << y;
    }
}

TEST(Path, SameSeedSameBitsOtherSeedOtherNoise) {
  const Room room = make_box_room(2);
  TraceScene a(test_device(), room.scene), b(test_device(), room.scene);
  Camera camera = Camera::from_fov(32, 24, 70);
  look_at(camera, {1.5, 1.5, 1.5}, {0, 0.8, 0});
  const TracePicture first = a.picture(camera, 80, 9), again = b.picture(camera, 80, 9),
                     other = a.picture(camera, 80, 10);
  EXPECT_EQ(first.mean.data, again.mean.data);
  EXPECT_EQ(first.variance.data, again.variance.data);
  EXPECT_NE(first.mean.data, other.mean.data);
}

TEST(Path, VarianceIsThatOfThePixelsMean) {
  const Room room = make_box_room(2);
  TraceScene scene(test_device(), room.scene);
  Camera camera = Camera::from_fov(16, 12, 70);
  look_at(camera, {1.5, 1.5, 1.5}, {0, 0.8, 0});
  constexpr int runs = 40;
  std::vector<double> sum(16 * 12, 0), squares(16 * 12, 0), stated(16 * 12, 0);
  for (int r = 0; r < runs; ++r) {
    const TracePicture p = scene.picture(camera, 32, 100 + static_cast<std::uint32_t>(r));
    for (std::size_t i = 0; i < sum.size(); ++i) {
      const double v = static_cast<double>(p.mean.data[i]);
      sum[i] += v, squares[i] += v * v, stated[i] += static_cast<double>(p.variance.data[i]);
    }
  }
  double measured_total = 0, stated_total = 0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    measured_total += (squares[i] - sum[i] * sum[i] / runs) / (runs - 1);
    stated_total += stated[i] / runs;
  }
  ASSERT_GT(stated_total, 0);
  // 192 pixels of 39 degrees of freedom each, with heavy tails: within a quarter.
  EXPECT_NEAR(measured_total / stated_total, 1, 0.25);
}

TEST(Path, ABoundOnIndirectLightOnlyDarkens) {
  const Room room = make_box_room(2);
  TraceScene scene(test_device(), room.scene);
  Camera camera = Camera::from_fov(16, 12, 70);
  look_at(camera, {1.5, 1.5, 1.5}, {0, 0.8, 0});
  const auto picture = [&](float most) { return scene.picture(camera, 64, 9, kMaxDepth, kLightSamples, most); };
  const TracePicture free = scene.picture(camera, 64, 9), loose = picture(1e30f), tight = picture(0.05f),
                     none = picture(0.f);
  EXPECT_EQ(free.mean.data, loose.mean.data);
  const TracePicture direct = scene.picture(camera, 64, 9, 1);
  double tighter = 0, freely = 0;
  for (std::size_t i = 0; i < free.mean.data.size(); ++i) {
    EXPECT_LE(none.mean.data[i], tight.mean.data[i]);
    EXPECT_LE(tight.mean.data[i], free.mean.data[i]);
    // Nothing is left but what lights send to the first surface: the same 64 samples, summed with zeros between.
    EXPECT_NEAR(none.mean.data[i], direct.mean.data[i], 64 * kFloatRounding * direct.mean.data[i]);
    tighter += static_cast<double>(tight.variance.data[i]), freely += static_cast<double>(free.variance.data[i]);
  }
  EXPECT_LT(tighter, freely);
}

TEST(Path, NoSamplesIsAnError) {
  TraceScene scene(test_device(), make_box_room(2).scene);
  EXPECT_THROW(scene.picture(Camera::from_fov(8, 8, 70), 0, 1), Error);
  EXPECT_NO_THROW(scene.picture(Camera::from_fov(8, 8, 70), 1, 1, 2, 15));
  for (const int light_samples : {-1, 16})
    EXPECT_THROW(scene.picture(Camera::from_fov(8, 8, 70), 1, 1, 2, light_samples), Error);
}

}  // namespace
}  // namespace clerestory
