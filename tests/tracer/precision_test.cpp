// The path tracer in float beside its double twin, sample by sample: both see the same random numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "tests/tracer/scene_probe.hpp"
#include "tests/worst.hpp"

namespace clerestory {
namespace {

/// A closed room `size` metres wide about `middle`, its floor of the given roughness, half metal; a lamp on the wall or
/// under the ceiling, and a pane before a sky with a bright pixel.
struct Case {
  const char* name;
  float size = 4;
  glm::vec3 middle{0};
  float roughness = 0.6f;
  float lamp = 0.3f;      // width over the room's
  float lamp_up = 0.98f;  // height over the room's; below 0.5 it stands on the wall
  float eye_up = 0.6f;    // eyes over the room's height
};

World room_of(const Case& c) {
  World world;
  const glm::mat4 place(glm::vec4(c.size, 0, 0, 0), glm::vec4(0, c.size, 0, 0), glm::vec4(0, 0, c.size, 0),
                        glm::vec4(c.middle, 1));
  Shapes shapes(world, place, Random(1));
  const int wall = shapes.material(plain({0.6f, 0.5f, 0.4f}, 0.8f));
  shapes.box({-0.5f, 0, -0.5f}, {0.5f, 0.6f, 0.5f}, wall);
  turn_inside_out(world);
  const int floor = shapes.material(plain({0.7f, 0.5f, 0.3f}, c.roughness, 0.5f));
  shapes.quad({-0.5f, 0.001f, 0.5f}, {0.5f, 0.001f, 0.5f}, {0.5f, 0.001f, -0.5f}, {-0.5f, 0.001f, -0.5f}, floor);
  shapes.sphere({0.2f, 0.15f, -0.2f}, 0.12f, floor, 6);
  const int lamp = shapes.emitter({glm::vec3(0.1f / (c.lamp * c.lamp)), false});
  const float w = c.lamp / 2, y = 0.6f * c.lamp_up;
  if (c.lamp_up > 0.5f)
    shapes.quad({-w, y, -w}, {w, y, -w}, {w, y, w}, {-w, y, w}, wall, lamp);
  else
    shapes.quad({-w, y, -0.49f}, {w, y, -0.49f}, {w, y + c.lamp, -0.49f}, {-w, y + c.lamp, -0.49f}, wall, lamp);
  const int pane = shapes.emitter({glm::vec3(1), true});
  shapes.quad({-0.49f, 0.2f, 0.3f}, {-0.49f, 0.2f, -0.3f}, {-0.49f, 0.5f, -0.3f}, {-0.49f, 0.5f, 0.3f}, wall, pane);
  world.panorama = {64, 32, std::vector<float>(64 * 32 * 3, 0.5f)};
  for (std::size_t k = 0; k < 3; ++k) world.panorama.rgb[3 * (14 * 64 + 16) + k] = 60;
  return world;
}

/// Rounding of a sample of direct light: the point where a ray lands is off by two roundings of its coordinates (of
/// size S), and so is the lamp's direction by that over the lamp's distance D; a cosine c takes it over c times larger,
/// and there is one at either end; every scattering adds as much. With D a third of the room that is 4 eps (S / D) / c,
/// where all but one in a hundred cosines exceed 0.1, or the lamp's own where it stands low.
double tolerance(const Case& c) {
  const glm::vec3 m = glm::abs(c.middle);
  const double coordinates = static_cast<double>(std::max({m.x, m.y, m.z}) + c.size) / static_cast<double>(c.size / 3);
  const double cosine = std::min(0.1, 0.6 * static_cast<double>(c.lamp_up));
  return 4 * FLT_EPSILON * coordinates / cosine;
}

// What float decides otherwise than double (a shadow's edge, roulette, the lobe of a direction), and the lobe of a
// smooth floor, whose density changes by 2 / alpha for a radian, are of few samples: a rate. The others agree by
// arithmetic, and float is no darker or brighter than double.
void expect_twins(const std::string& name, const std::vector<float>& single, const std::vector<float>& twin,
                  double most) {
  ASSERT_EQ(single.size(), twin.size());
  double far = 0, sum = 0, of_differences = 0, squares = 0;
  std::vector<double> relative;
  for (std::size_t i = 0; i < single.size(); ++i) {
    const double x = static_cast<double>(single[i]), y = static_cast<double>(twin[i]);
    ASSERT_TRUE(std::isfinite(x) && std::isfinite(y)) << name;
    const double larger = std::max(std::abs(x), std::abs(y));
    far += std::abs(x - y) > most * larger;
    sum += y, of_differences += x - y, squares += (x - y) * (x - y);
    if (larger > 0) relative.push_back(std::abs(x - y) / larger);
  }
  ASSERT_GT(relative.size(), single.size() / 2) << name;
  EXPECT_LT(far, 2e-3 * static_cast<double>(single.size())) << name;
  std::ranges::nth_element(relative, relative.begin() + static_cast<std::ptrdiff_t>(relative.size() / 2));
  EXPECT_LT(relative[relative.size() / 2], most / 20) << name;
  EXPECT_LT(std::abs(of_differences), most * sum + 4.5 * std::sqrt(squares)) << name;
}

TEST(Precision, RadianceFollowsItsDoubleTwin) {
  const Case cases[] = {{.name = "room"},
                        {.name = "smooth floor", .roughness = 0.01f},
                        {.name = "glossy floor", .roughness = 0.1f},
                        {.name = "tiny lamp", .lamp = 2e-4f},
                        {.name = "grazing light", .lamp = 0.01f, .lamp_up = 0.004f},
                        {.name = "grazing view", .eye_up = 0.004f},
                        {.name = "far from the origin", .middle = {60, 10, -80}},
                        {.name = "small room", .size = 0.2f}};
  constexpr int rays = 20000;
  for (const Case& c : cases) {
    const World world = room_of(c);
    TraceScene single(test_device(), world), twin(double_device(), world, Precision::Double);
    Random random(3);
    std::vector<float> points(3 * rays), directions(3 * rays);
    for (int i = 0; i < rays; ++i) {
      const glm::vec3 eye(random.between(-0.3f, 0.3f), 0.6f * c.eye_up, random.between(-0.1f, 0.3f)),
          target(random.between(-0.45f, 0.45f), 0.001f, random.between(-0.45f, 0.2f));
      for (int k = 0; k < 3; ++k) {
        points[static_cast<std::size_t>(k * rays + i)] = c.middle[k] + c.size * eye[k];
        directions[static_cast<std::size_t>(k * rays + i)] = target[k] - eye[k];
      }
    }
    for (const int depth : {1, 4}) {
      RadianceQuery query;
      query.seed = 12, query.max_depth = depth;
      expect_twins(std::string(c.name) + " depth " + std::to_string(depth), single.radiance(points, directions, query),
                   twin.radiance(points, directions, query), depth * tolerance(c));
    }
  }
}

TEST(Precision, PicturesAndMapsFollowTheirDoubleTwins) {
  const Case c{.name = "room"};
  const World world = room_of(c);
  TraceScene single(test_device(), world), twin(double_device(), world, Precision::Double);
  Camera camera = Camera::from_fov(64, 48, 80);
  look_at(camera, {1, 1.4, 1.2}, {-0.3, 0.8, -1});
  // 64 samples of a pixel: the sum of their differences, and of as many roundings of the sum.
  expect_twins("picture", single.picture(camera, 64, 3).mean.data, twin.picture(camera, 64, 3).mean.data,
               64 * tolerance(c));
  const TraceMaps a = single.maps(camera), b = twin.maps(camera);
  for (const Image TraceMaps::*map : {&TraceMaps::depth, &TraceMaps::albedo, &TraceMaps::roughness})
    expect_twins("map", (a.*map).data, (b.*map).data, tolerance(c));
  int other = 0;
  for (std::size_t i = 0; i < a.triangle.size(); ++i) other += a.triangle[i] != b.triangle[i];
  EXPECT_LE(other, 3) << "pixels whose centre an edge crosses within a rounding";
}

/// A floor of strips a metre and a half long and four millimetres wide, texture coordinates as its own before it is
/// turned.
World floor_of_slivers(const Material& material, const glm::mat3& turn) {
  World world;
  world.materials = {material};
  const auto vertex = [&](float x, int strip) {
    const glm::vec3 p(x, 0, -0.004f * static_cast<float>(strip));
    return Vertex{turn * p, p, turn * glm::vec3(0, 1, 0)};
  };
  for (int strip = 0; strip < 400; ++strip) {
    const Vertex a = vertex(-0.75f, strip), b = vertex(0.75f, strip), c = vertex(0.75f, strip + 1),
                 d = vertex(-0.75f, strip + 1);
    world.triangles.push_back({{a, b, c}}), world.triangles.push_back({{a, c, d}});
  }
  return world;
}

TEST(Precision, TexturesStayInPlaceOnSliversSeenEdgeOn) {
  Material material = plain(glm::vec3(0.1f), 1);
  material.texture = static_cast<float>(Texture::Plaster);
  material.color_b = glm::vec3(0.9f), material.scale = glm::vec3(200);
  const glm::mat3 turn(glm::rotate(glm::mat4(1), 0.7f, glm::normalize(glm::vec3(1, 2, 3))));
  const World world = floor_of_slivers(material, turn);
  TraceScene single(test_device(), world), twin(double_device(), world, Precision::Double);
  Camera camera = Camera::from_fov(64, 48, 30);
  look_at(camera, {0.1, 0.02, 0.3}, {0, 0, -0.7});
  camera.set_pose(Mat3(turn) * camera.rotation(), Mat3(turn) * camera.position());
  const TraceMaps a = single.maps(camera), b = twin.maps(camera);
  int seen = 0, off = 0;
  double worst = 0;
  for (std::size_t i = 0; i < a.depth.pixels(); ++i) {
    if (b.depth.data[i] <= 0 || a.depth.data[i] <= 0) continue;
    ++seen;
    // The pattern changes by at most some 1000 a metre; a ray lands within two roundings over its slope: 8e-6 metres.
    worst = worse(worst, std::abs(a.albedo.data[i] - b.albedo.data[i]));
    off += !(std::abs(a.albedo.data[i] - b.albedo.data[i]) <= 0.008f);
  }
  EXPECT_GT(seen, 300);
  EXPECT_EQ(off, 0) << "of " << seen << " worst " << worst;
}

}  // namespace
}  // namespace clerestory
