// Light of lamps and of panes, one scattering, against quadrature in double; the sky's sampler; shadows.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "checks/trace/path_reference.hpp"
#include "host/math/panorama.hpp"
#include "tests/roundings.hpp"
#include "tests/tracer/scene_probe.hpp"
#include "tracer/light_tables.hpp"

namespace clerestory {
namespace {

using reference::V;

// Estimates are compared at 4.5 standard errors: seven in a million would fail by chance, and seeds are fixed.
constexpr double kSigmas = 4.5;

/// A world of a floor at y = 0, rectangles that emit (fronts where a, b, d run counter-clockwise) and occluders.
struct Stage {
  struct Rectangle {
    V corner, u, v;
    int emitter;
  };
  World world;
  reference::Brdf brdf;
  std::vector<Rectangle> lights, occluders;

  explicit Stage(const reference::Brdf& floor) : brdf(floor) {
    Shapes shapes(world, glm::mat4(1), Random(1));
    const int m = shapes.material(
        plain(glm::vec3(brdf.albedo), static_cast<float>(brdf.roughness), static_cast<float>(brdf.metallic)));
    shapes.quad({-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}, m);
  }
  void light(const glm::vec3& corner, const glm::vec3& u, const glm::vec3& v, const Emitter& emitter) {
    Shapes shapes(world, glm::mat4(1), Random(1));
    const int e = shapes.emitter(emitter);
    shapes.quad(corner, corner + u, corner + u + v, corner + v, 0, e);
    lights.push_back({corner, u, v, e});
  }
  void occluder(const glm::vec3& corner, const glm::vec3& u, const glm::vec3& v) {
    Shapes(world, glm::mat4(1), Random(1)).quad(corner, corner + u, corner + u + v, corner + v, 0);
    occluders.push_back({corner, u, v, -1});
  }

  bool blocked(const V& x, const V& to) const {
    return std::ranges::any_of(occluders, [&](const Rectangle& o) {
      const V n = glm::cross(o.u, o.v);
      const double t = glm::dot(o.corner - x, n) / glm::dot(to - x, n);
      const V at = x + t * (to - x) - o.corner;
      const double u = glm::dot(at, o.u) / glm::dot(o.u, o.u), v = glm::dot(at, o.v) / glm::dot(o.v, o.v);
      return t > 0 && t < 1 && u > 0 && u < 1 && v > 0 && v < 1;
    });
  }
  /// Radiance that floor point x sends towards wo: the sum over n x n cells of every light, midpoint rule.
  V reflected(const V& x, const V& wo, int n) const {
    const auto local = [](const V& v) { return V(v.x, -v.z, v.y); };  // y up becomes z up
    V sum(0);
    for (const Rectangle& light : lights) {
      const Emitter& e = world.emitters[static_cast<std::size_t>(light.emitter)];
      const V cross = glm::cross(light.u, light.v), normal = glm::normalize(cross);
      for (int i = 0; i < n; ++i)
        for (int k = 0; k < n; ++k) {
          const V to = light.corner + (i + 0.5) / n * light.u + (k + 0.5) / n * light.v, d = to - x;
          const double d2 = glm::dot(d, d);
          const V wi = d / std::sqrt(d2);
          const double facing = -glm::dot(wi, normal);
          if (facing <= 0 || wi.y <= 0 || blocked(x, to)) continue;
          const V radiance = V(e.radiance) * (e.panorama ? reference::sky(world, wi) : V(1));
          sum += brdf(local(wi), local(wo)) * radiance * (wi.y * facing / d2 * glm::length(cross) / (n * n));
        }
    }
    return sum;
  }
};

const glm::vec3 kPoint(0.3f, 0, 0.2f);
const glm::vec3 kView = glm::normalize(glm::vec3(-0.3f, 0.8f, 0.5f));

/// Direct light at kPoint by that many samples of lights; 0: the surface's directions alone.
Estimate traced(TraceScene& scene, int light_samples, int rays, int spp, std::uint32_t seed) {
  RadianceQuery query;
  query.max_depth = 1, query.light_samples = light_samples, query.seed = seed, query.spp = spp;
  return estimate(scene, kPoint + 0.5f * kView, -kView, rays, query);
}

enum class SkyKind { Even, Uneven, BrightPatch, BrightPixel };

Panorama panorama(SkyKind kind) {
  Panorama p{64, 32, {}};
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) {
      glm::vec3 rgb(0.5f, 0.6f, 0.7f);
      if (kind == SkyKind::Uneven) rgb *= 0.2f + 3 * ((x * 7 + y * 3) % 5 == 0);
      if (kind == SkyKind::BrightPatch && x >= 30 && x < 36 && y >= 8 && y < 13) rgb = {90, 80, 60};
      if (kind == SkyKind::BrightPixel && x == 33 && y == 10) rgb = {900, 800, 600};
      p.rgb.insert(p.rgb.end(), {rgb.x, rgb.y, rgb.z});
    }
  return p;
}

/// A pane of three by three metres two metres away, tinted, behind which the sky is turned; and a lamp if asked.
Stage behind_a_pane(SkyKind kind, const reference::Brdf& floor, bool lamp) {
  Stage stage(floor);
  stage.world.panorama = panorama(kind), stage.world.panorama_turn = 0.3f;
  stage.light({-2.2f, 0.2f, -1.8f}, {3, 0, 0}, {0, 3, 0}, {{0.9f, 0.8f, 0.5f}, true});
  if (lamp) stage.light({-0.25f, 1, -0.25f}, {0.5f, 0, 0}, {0, 0, 0.5f}, {{3, 2, 1}, false});
  return stage;
}

// Light of one scattering is the same by any choice of samples: points on lamps and panes, the sky's directions, the
// surface's directions, each weighed against the others. What has the wrong density, or leaves one out, is off by more
// than the samples leave in doubt: of the bright patch nine tenths of the density are the sky's.
void expect_quadrature(const Stage& stage, const std::string& name, double most_error) {
  TraceScene scene(test_device(), stage.world);
  const V expected = stage.reflected(V(kPoint), V(kView), 300);
  for (const int light_samples : {0, 1, 3}) {
    const Estimate e = traced(scene, light_samples, 50000, 4, 3);
    for (int c = 0; c < 3; ++c) {
      ASSERT_GT(e.mean[c], 0);
      // 1e-3: the offset of rays, 0.1 mm in a metre, and the midpoint rule.
      EXPECT_NEAR(e.mean[c], expected[c], kSigmas * e.error[c] + 1e-3 * expected[c])
          << name << ", light samples " << light_samples << ", channel " << c;
      if (light_samples == 3) {
        EXPECT_LT(e.error[c], most_error * expected[c]) << name;
      }
    }
  }
}

TEST(Light, PanesAndLampsEqualQuadrature) {
  for (const auto& [roughness, metallic] : {std::pair{1.0, 0.0}, {0.3, 1.0}}) {
    const reference::Brdf floor{{0.6, 0.4, 0.2}, roughness, metallic};
    const std::string of = fmt::format(" on roughness {}", roughness);
    expect_quadrature(behind_a_pane(SkyKind::Even, floor, false), "an even sky" + of, 0.004);
    expect_quadrature(behind_a_pane(SkyKind::BrightPatch, floor, false), "a bright patch" + of, 0.003);
    expect_quadrature(behind_a_pane(SkyKind::BrightPixel, floor, true), "a bright pixel and a lamp" + of, 0.005);
    expect_quadrature(behind_a_pane(SkyKind::Uneven, floor, true), "an uneven sky and a lamp" + of, 0.005);
    Stage lamp(floor);
    lamp.light({-0.25f, 1, -0.25f}, {0.5f, 0, 0}, {0, 0, 0.5f}, {{3, 2, 1}, false});
    lamp.light({0.6f, 0.8f, 0}, {0.2f, 0, 0}, {0, 0, 0.3f}, {{9, 5, 2}, false});
    expect_quadrature(lamp, "two lamps" + of, 0.004);
    // About as likely by the surface's directions as by points: a weight that is off shows most.
    Stage wide(floor);
    wide.light({-1.5f, 1, -1.5f}, {3, 0, 0}, {0, 0, 3}, {{3, 2, 1}, false});
    expect_quadrature(wide, "a wide lamp" + of, 0.0015);
  }
}

// The sampler of the sky's directions draws what its density says, quarter by quarter of every pixel.
// The last sky is coarse and lies above: of its large pixels, those round the pole too are filled by solid angle.
TEST(Light, SkyIsDrawnByItsDensity) {
  constexpr int count = 400000;
  Stage skylight({});
  skylight.light({-0.5f, 2, -0.5f}, {1, 0, 0}, {0, -0.5f, 1}, {glm::vec3(1), true});
  skylight.world.panorama = {16, 8, std::vector<float>(16 * 8 * 3, 1.f)};
  const std::pair<const char*, World> skies[] = {{"even", behind_a_pane(SkyKind::Even, {}, false).world},
                                                 {"uneven", behind_a_pane(SkyKind::Uneven, {}, false).world},
                                                 {"bright patch", behind_a_pane(SkyKind::BrightPatch, {}, false).world},
                                                 {"coarse", skylight.world}};
  for (const auto& [kind, world] : skies) {
    const LightTables tables = make_light_tables(world);
    const int w = world.panorama.width, h = world.panorama.height;
    Random random(23);
    std::vector<double> pairs(2 * count);
    for (double& v : pairs) v = static_cast<double>(random.unit());
    Device device = test_device();
    const Buffer sky = upload<float>(device, {tables.sky.begin(), tables.sky.end()});
    const float turn = world.panorama_turn / (2 * std::numbers::pi_v<float>);
    const std::vector<double> drawn = probe<float>("probe_sky", {sky, w, h, turn}, device, pairs, count, 4);

    std::vector<int> counts(static_cast<std::size_t>(4 * w * h), 0);
    const auto density = [&](int column, int row) {
      return static_cast<double>(tables.sky[static_cast<std::size_t>(h + (h + row) * w + column)]);
    };
    int other_density = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const V d(drawn[i], drawn[count + i], drawn[2 * count + i]);
      ASSERT_NEAR(glm::length(d), 1, 8 * kFloatRounding);
      const double a = static_cast<double>(world.panorama_turn);
      const Vec2 uv =
          panorama_position({std::cos(a) * d.x - std::sin(a) * d.z, d.y, std::sin(a) * d.x + std::cos(a) * d.z});
      const int column = std::min(static_cast<int>(uv.x * 2 * w), 2 * w - 1),
                row = std::min(static_cast<int>(uv.y * 2 * h), 2 * h - 1);
      ++counts[static_cast<std::size_t>(row * 2 * w + column)];
      other_density += !(std::abs(drawn[3 * count + i] - density(column / 2, row / 2)) <= 1e-6 * drawn[3 * count + i]);
    }
    // A direction is rounded to eps, and acos near a pole to its root: few lie that near to a pixel's border.
    EXPECT_LT(other_density, 1e-3 * count) << kind;

    double statistic = 0, total = 0, rest = 0, in_rest = 0;
    int cells = 0;
    for (int row = 0; row < 2 * h; ++row)
      for (int column = 0; column < 2 * w; ++column) {
        const double expected = count * density(column / 2, row / 2) * panorama_solid_angle(row, 2 * w, 2 * h);
        const double found = counts[static_cast<std::size_t>(row * 2 * w + column)];
        total += expected;
        if (expected < 8) {
          rest += expected, in_rest += found;
        } else {
          statistic += (found - expected) * (found - expected) / expected, ++cells;
        }
      }
    EXPECT_NEAR(total / count, 1, 8 * kFloatRounding);  // of a density: its pixel's share, and its solid angle
    ASSERT_GT(cells, 100);
    // Chi-square of many cells is normal: mean `cells`, variance twice that. Of the rest, counts alone; 1e-3 of all
    // samples for those that rounding moves over a border.
    EXPECT_LT(statistic, cells + kSigmas * std::sqrt(2.0 * cells)) << kind;
    EXPECT_NEAR(in_rest, rest, kSigmas * std::sqrt(rest) + 1e-4 * count) << kind;
  }
}

/// One lamp or pane, and how something between it and kPoint is placed: a copy of it drawn towards kPoint.
Stage shadowed(bool pane, double way, double width, double enlarged) {
  Stage stage({{0.6, 0.4, 0.2}, 0.5, 0});
  stage.world.panorama = panorama(SkyKind::BrightPatch), stage.world.panorama_turn = 0.3f;
  if (pane)
    stage.light({-2.2f, 0.4f, -1.8f}, {3, 0, 0}, {0, 3, 0}, {glm::vec3(1), true});
  else
    stage.light({-0.25f, 1, -0.25f}, {0.5f, 0, 0}, {0, 0, 0.5f}, {{3, 2, 1}, false});
  const Stage::Rectangle light = stage.lights[0];
  const V corner = V(kPoint) + way * (light.corner - V(kPoint)), u = way * light.u, v = way * light.v,
          margin = (u + v) * (enlarged - 1) / 2.0;
  if (width > 0) stage.occluder(glm::vec3(corner - margin), glm::vec3(u * (enlarged * width)), glm::vec3(v * enlarged));
  return stage;
}

// What stands anywhere between a point and a lamp or pane keeps the light off, from half a millimetre off the surface
// to the last permille of the way; the rest of it shines on.
TEST(Light, ShadowsReachFromTheSurfaceToTheLight) {
  for (const bool pane : {false, true}) {
    {
      const Stage free = shadowed(pane, 1, 0, 1);
      TraceScene scene(test_device(), free.world);
      const V expected = free.reflected(V(kPoint), V(kView), 300);
      const Estimate e = traced(scene, 3, 20000, 4, 5);
      EXPECT_NEAR(e.mean[0], expected[0], kSigmas * e.error[0] + 1e-3 * expected[0]);
    }
    for (const double way : {5e-4, 1e-3, 3e-3, 0.01, 0.05, 0.5, 0.7, 0.9, 0.95, 0.99, 0.999}) {
      // Rays start 0.1 mm off the surface: what is half a millimetre off looks a quarter larger from there, and
      // shifted.
      TraceScene scene(test_device(), shadowed(pane, way, 1, way < 0.01 ? 1.5 : 1.01).world);
      for (const int light_samples : {0, 3})
        EXPECT_EQ(traced(scene, light_samples, 2000, 4, 5).mean[0], 0)
            << "pane " << pane << " at " << way << " light samples " << light_samples;
      if (way < 0.05) continue;
      const Stage half = shadowed(pane, way, 0.5, 1);
      TraceScene seen(test_device(), half.world);
      const V expected = half.reflected(V(kPoint), V(kView), 300);
      ASSERT_GT(expected[0], 0);
      const Estimate e = traced(seen, 3, 20000, 4, 5);
      // 3e-3: the edge of the shadow within a row of 300, and the offset of rays.
      EXPECT_NEAR(e.mean[0], expected[0], kSigmas * e.error[0] + 3e-3 * expected[0]) << "pane " << pane << " " << way;
    }
  }
}

}  // namespace
}  // namespace clerestory
