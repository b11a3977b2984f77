// Procedural materials beside their formulas; and what is finer than a pixel is averaged over it: maps of few pixels
// against the block means of maps of many.
#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>

#include "tests/roundings.hpp"
#include "tests/tracer/scene_probe.hpp"
#include "tests/tracer/texture_reference.hpp"

namespace clerestory {
namespace {

constexpr int kPrints = 13;  // patterns of Texture::Print
constexpr int kWidth = 40, kHeight = 30, kTimes = 16;

/// A wall two metres before the camera, texture coordinates along x and y in metres.
World wall(const Material& material) {
  World world;
  world.materials = {material};
  const glm::vec3 corners[4] = {{-4, -3, -2}, {4, -3, -2}, {4, 3, -2}, {-4, 3, -2}};
  for (const auto& [b, c] : {std::pair{1, 2}, std::pair{2, 3}}) {
    Triangle t;
    const int of[3] = {0, b, c};
    for (int k = 0; k < 3; ++k) t.v[k] = {corners[of[k]], corners[of[k]], {0, 0, 1}};
    world.triangles.push_back(t);
  }
  return world;
}

Material tiles(float size, float gap) {
  Material m = plain(glm::vec3(0.4f), 0.1f);
  m.texture = static_cast<float>(Texture::Tiles);
  m.roughness_c = 0.9f;
  m.scale = {1 / size, 2 / size, 1};
  m.gap = gap;
  return m;
}

struct Compared {
  double farthest = 0, mean = 0, fine_mean = 0, spread = 0;
};

/// Roughness of pixels against the means of the kTimes^2 pixels that divide each; spread: of the coarse pixels.
Compared compare(const Material& material) {
  TraceScene scene(test_device(), wall(material));
  const double fov = 24;  // pixels at the edge see the wall within 3 % of its front
  const Image coarse = scene.maps(Camera::from_fov(kWidth, kHeight, fov)).roughness;
  const Image fine = scene.maps(Camera::from_fov(kWidth * kTimes, kHeight * kTimes, fov)).roughness;
  Compared out;
  double squares = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double block = 0;
      for (int k = 0; k < kTimes * kTimes; ++k)
        block += static_cast<double>(fine.at(0, y * kTimes + k / kTimes, x * kTimes + k % kTimes));
      block /= kTimes * kTimes;
      const double value = static_cast<double>(coarse.at(0, y, x));
      out.farthest = std::max(out.farthest, std::abs(value - block));
      out.mean += value, out.fine_mean += block, squares += value * value;
    }
  }
  constexpr int pixels = kWidth * kHeight;
  out.mean /= pixels, out.fine_mean /= pixels;
  out.spread = std::sqrt(std::max(0.0, squares / pixels - out.mean * out.mean));
  return out;
}

TEST(Texture, AJointIsSeenByItsShareOfThePixel) {
  // The box over a pixel is exact along each axis and 3 % too wide at the picture's edge.
  for (const auto& [size, gap] : {std::pair{0.6f, 0.01f}, {0.2f, 0.02f}, {0.05f, 0.03f}, {0.01f, 0.2f}}) {
    const Compared c = compare(tiles(size, gap));
    EXPECT_LT(c.farthest, 0.03 * 0.8) << size;
    // What one box takes too much its neighbour's lacks, but for one pixel in nine, which has the border for one.
    EXPECT_NEAR(c.mean, c.fine_mean, 0.03 * 0.8 / 9) << size;
    // Half of `gap` lies on either side of an edge across u; across v the same metres are twice that share.
    const double open = (1 - 2 * static_cast<double>(gap)) * (1 - 4 * static_cast<double>(gap));
    EXPECT_NEAR(c.fine_mean, 0.9 - 0.8 * open, 0.02) << size;  // the border cuts tiles
  }
}

TEST(Texture, JointsBelowThePixelBlurToAConstant) {
  EXPECT_LT(compare(tiles(0.002f, 0.2f)).spread, 0.02);
  EXPECT_GT(compare(tiles(0.2f, 0.05f)).spread, 0.05);
}

TEST(Texture, GrainBelowThePixelBlursToItsMean) {
  Material leather = plain(glm::vec3(0.4f), 0.3f);
  leather.texture = static_cast<float>(Texture::Leather);
  leather.roughness_a = 0.8f;
  leather.scale = glm::vec3(2000.f);
  const Compared c = compare(leather);
  EXPECT_LT(c.spread, 1e-3);
  leather.scale = glm::vec3(3.f);
  EXPECT_GT(compare(leather).spread, 0.05);
  // The mean that blurred leather takes is that of leather near by.
  EXPECT_NEAR(compare(leather).fine_mean, c.mean, 0.05);  // of the grains that the picture happens to show
}

/// A material of which every number shows, capped as in rooms.
Material vivid(Texture texture, int pattern, bool gap, Random random) {
  Material m;
  m.texture = static_cast<float>(texture), m.pattern = static_cast<float>(pattern);
  const auto color = [&] { return glm::vec3(random.unit(), random.unit(), random.unit()); };
  m.color_a = color(), m.color_b = color(), m.color_c = color();
  m.roughness_a = 0.2f, m.roughness_b = 0.5f, m.roughness_c = 0.9f;
  m.metallic_a = 1, m.metallic_b = 0.3f, m.metallic_c = 0;
  m.scale = {random.between(2, 6), random.between(2, 6), random.between(2, 6)};
  m.gap = !gap ? 0 : texture == Texture::Stone ? 0.5f : random.between(0.02f, 0.1f);
  m.tint = 0.2f, m.warp = 1.5f, m.noise = gap ? 0.1f : 0.f, m.wear = gap ? 0.4f : 0.f;
  m.seed = static_cast<float>(random.whole(0, 4095));
  if (gap) m.smudge = 0.3f, m.smudge_scale = 5, m.stain = 0.25f, m.stain_scale = 3;
  return m;
}

/// Texture coordinates in (-1, 1), as rugs and pictures have them and as good as any for the others, and footprints: a
/// point, or up to wider than every pattern.
std::vector<double> places(int count, Random random) {
  std::vector<double> at(4 * static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = static_cast<double>(random.between(-1, 1));
  for (int i = 0; i < count; ++i)
    at[static_cast<std::size_t>(3 * count + i)] =
        i % 4 == 0 ? 0 : static_cast<double>(std::exp(random.between(std::log(1e-4f), std::log(0.8f))));
  return at;
}

std::vector<float> numbers_of(const Material& m) {
  const auto* from = reinterpret_cast<const float*>(&m);
  return {from, from + sizeof(m) / sizeof(float)};
}

template <class Real>
std::vector<double> textured(Device device, const Material& m, const std::vector<double>& at, int count) {
  const std::vector<float> numbers = numbers_of(m);
  const Buffer record = upload<Real>(device, {numbers.begin(), numbers.end()});
  return probe<Real>("probe_texture", {record}, device, at, count, 5);
}

TEST(Texture, EveryFamilyEqualsItsFormula) {
  constexpr int count = 1500;
  // In double the kernel and the formula differ by the order of their roundings: up to 1000 cells from zero, through
  // slopes of up to 120 a cell. In float the same is 200 cells (eps / 2 for each of two products) times 120.
  constexpr double in_double = 1000 * 120 * 4 * DBL_EPSILON, in_float = 200 * 120 * FLT_EPSILON;
  Random random(17);
  int far_in_float = 0, all = 0;
  for (int texture = 0; texture <= static_cast<int>(Texture::Print); ++texture) {
    const int patterns = texture == static_cast<int>(Texture::Print) ? kPrints : 3;
    for (int kind = 0; kind < 2 * patterns; ++kind) {
      const Material m =
          vivid(static_cast<Texture>(texture), kind % patterns, kind < patterns, random.fork(random.bits()));
      const std::vector<double> at = places(count, random.fork(random.bits()));
      const std::vector<double> exact = textured<double>(double_device(), m, at, count),
                                rounded = textured<float>(test_device(), m, at, count);
      const reference::TextureFormula formula(m);
      for (std::size_t i = 0; i < count; ++i) {
        const auto row = [&](std::size_t r) { return at[r * count + i]; };
        const std::array<double, 5> expected = formula({row(0), row(1), row(2)}, row(3));
        for (std::size_t c = 0; c < 5; ++c) {
          ASSERT_NEAR(exact[c * count + i], expected[c], in_double)
              << "texture " << texture << " kind " << kind << " at " << row(0) << " " << row(1) << " " << row(2)
              << " footprint " << row(3) << " value " << c;
          far_in_float += !(std::abs(rounded[c * count + i] - expected[c]) <= in_float);
          ++all;
        }
      }
    }
  }
  // Joints and cells are steps: a rounding decides where a point lies within 1e-5 of one, a few in a cell.
  EXPECT_LT(far_in_float, 1e-3 * all);
}

TEST(Texture, PrintsBelowThePixelBlurToTheirMean) {
  Random random(5);
  for (int pattern = 0; pattern < kPrints; ++pattern) {
    double seen[2] = {0, 0}, near = 0;
    constexpr int count = 20000, seeds = 16;
    for (int seed = 0; seed < seeds; ++seed) {  // damask has one motif of each
      Material m;
      m.texture = static_cast<float>(Texture::Print), m.pattern = static_cast<float>(pattern);
      m.roughness_a = 0, m.roughness_b = 0.5f, m.roughness_c = 1;
      m.gap = 0.05f, m.warp = 1, m.seed = static_cast<float>(seed);
      const reference::TextureFormula formula(m);
      for (int i = 0; i < count; ++i) {
        const glm::dvec3 p(random.between(-50, 50), random.between(-50, 50), 0);
        near += formula(p, 0)[3] / (count * seeds);
      }
      const glm::dvec3 p(0.3, 0.4, 0);
      seen[0] = formula(p, 1.5)[3], seen[1] = formula(p + 3.3, 2)[3];
    }
    EXPECT_EQ(seen[0], seen[1]) << pattern;
    // Motifs of sixteen seeds, cells of one repeat over a hundred metres.
    EXPECT_NEAR(seen[0], near, 0.03) << pattern;
  }
}

TEST(Texture, AlbedoEndsAtTheMostOfItsKind) {
  for (const auto& [metallic, most] : {std::pair{0.f, 0.78}, {0.5f, 0.85}, {1.f, 0.92}}) {
    Material m = plain({1, 0.9f, 0.3f}, 0.4f, metallic);
    m.uncapped = 0;
    const std::vector<double> v = textured<float>(test_device(), m, {0, 0, 0, 0}, 1);
    constexpr double rounding = 4 * kFloatRounding;  // of the colour, and of the limit between two kinds
    EXPECT_NEAR(v[0], most, rounding);
    EXPECT_NEAR(v[1], std::min(most, 0.9), rounding);
    EXPECT_NEAR(v[2], 0.3, rounding);
    m.uncapped = 1;
    EXPECT_EQ(textured<float>(test_device(), m, {0, 0, 0, 0}, 1)[0], 1);
  }
}

/// Maps of a wall that leans away, through pixels that are no squares: every pixel's material is the formula at its
/// point over its footprint, the geometric mean of the two sides that the pixel has on the surface.
TEST(Texture, MapsShowTheFormulaAtThePixelsFootprint) {
  for (const Texture texture : {Texture::Tiles, Texture::Wood, Texture::Leather}) {
    Material m = vivid(texture, 0, true, Random(8));
    m.scale = texture == Texture::Leather ? glm::vec3(60) : glm::vec3(9, 7, 20);
    World world = wall(m);
    for (Triangle& t : world.triangles)
      for (Vertex& v : t.v) v.position.z += 0.4f * v.position.x;
    TraceScene scene(test_device(), world);
    Camera camera = Camera::from_fov(64, 48, 60);
    camera.fy = 3 * camera.fx, camera.cx += 3, camera.cy -= 5;
    const TraceMaps maps = scene.maps(camera);
    const reference::TextureFormula formula(m);
    int far = 0, seen = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const Vec3 ray = camera.ray(x + 0.5, y + 0.5);
        const double depth = 2 / (1 + 0.4 * ray.x);  // z = -2 + 0.4 x
        const Vec3 at = depth * ray, normal = Vec3(-0.4, 0, 1) / std::sqrt(1.16);
        const double cosine = glm::dot(normal, -glm::normalize(ray));
        const double footprint = depth / std::sqrt(camera.fx * camera.fy * cosine * glm::length(ray));
        const std::array<double, 5> expected = formula({at.x, at.y, -2}, footprint);
        if (maps.triangle[static_cast<std::size_t>(y * camera.width + x)] < 0) continue;
        // Sixteen roundings of corners up to 4 m away.
        EXPECT_NEAR(static_cast<double>(maps.depth.at(0, y, x)), depth, 16 * 4 * kFloatRounding);
        // As in float above: points are rounded to eps of two metres, 40 cells.
        far += std::abs(static_cast<double>(maps.roughness.at(0, y, x)) - expected[3]) > 2e-3;
        for (int c = 0; c < 3; ++c)
          far += std::abs(static_cast<double>(maps.albedo.at(c, y, x)) - expected[static_cast<std::size_t>(c)]) > 2e-3;
        seen += 4;
      }
    EXPECT_GT(seen, 4 * 2000);
    EXPECT_LT(far, 2e-3 * seen) << static_cast<int>(texture);
  }
}

}  // namespace
}  // namespace clerestory
