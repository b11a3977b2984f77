// Solids: closed, turned outwards, with normals that follow their faces.
#include "tracer/shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <numbers>

#include "tests/roundings.hpp"
#include "tests/tracer/scenes.hpp"
#include "tracer/room.hpp"
#include "tracer/trace_objects.hpp"

namespace clerestory {
namespace {

glm::vec3 face_cross(const Triangle& t) {
  return glm::cross(t.v[1].position - t.v[0].position, t.v[2].position - t.v[0].position);
}

/// Volume by the divergence theorem: that of the solid only if every face is there and looks outwards.
double volume(const World& scene) {
  double sum = 0;
  for (const Triangle& t : scene.triangles) sum += static_cast<double>(glm::dot(t.v[0].position, face_cross(t))) / 6;
  return sum;
}

/// Edges that no neighbour runs through the other way, between corners that are the same bits: 0 on a closed surface. A
/// ray could pass where seams or poles miss each other by a rounding.
int open_edges(const World& scene) {
  using Corner = std::array<float, 3>;
  std::map<std::pair<Corner, Corner>, int> balance;
  for (const Triangle& t : scene.triangles)
    for (int k = 0; k < 3; ++k) {
      const auto corner = [&](int i) {
        const glm::vec3& p = t.v[i % 3].position;
        return Corner{p.x, p.y, p.z};
      };
      ++balance[{corner(k), corner(k + 1)}], --balance[{corner(k + 1), corner(k)}];
    }
  return static_cast<int>(std::ranges::count_if(balance, [](const auto& edge) { return edge.second > 0; }));
}

struct Solid {
  const char* name;
  double volume, tolerance;  // metres^3: of corners in float, up to 6 m away, and what facets of a ball cut off
  std::function<void(Shapes&)> build;
};

TEST(Shapes, SolidsAreClosedAndTurnedOutwards) {
  constexpr double pi = std::numbers::pi, of_facets = (pi / 40) * (pi / 40);
  const std::vector<Solid> solids = {
      {"box", 0.5 * 2 * 3, 1e-5,
       [](Shapes& s) {
         s.box({1, 2, 3}, {1.5f, 4, 6}, 0);
       }},
      {"block", 0.06, 1e-6,
       [](Shapes& s) {
         s.block({1, 0, 0}, {0.2f, 0.3f, 1}, 0);
       }},
      {"rod", 0.02 * 0.02 * std::sqrt(3.0), 1e-6,
       [](Shapes& s) {
         s.rod({0, 0, 0}, {1, 1, 1}, 0.02f, 0);
       }},
      {"upright rod", 0.02 * 0.02, 1e-6,
       [](Shapes& s) {
         s.rod({0, 1, 0}, {0, 0, 0}, 0.02f, 0);
       }},
      // A prism of 64 sides holds sin(2 pi / 64) / (2 pi / 64) of its cylinder.
      {"cylinder", 2 * 0.25 * 32 * std::sin(2 * pi / 64), 2e-6,
       [](Shapes& s) {
         s.cylinder({0, 1, 0}, 0.5f, 2, 0, 64);
       }},
      {"cone", 2 * 0.25 / 3 * 32 * std::sin(2 * pi / 64), 2e-6,
       [](Shapes& s) {
         s.lathe({0, 0, 0}, {{0.5f, 0}, {0, 2}}, 0, 64);
       }},
      {"sphere", 4.0 / 3 * pi * 0.125, 4.0 / 3 * pi * 0.125 * of_facets,
       [](Shapes& s) {
         s.sphere({1, 1, 1}, 0.5f, 0, 40);
       }},
      // Twelve sides of a section, 64 around, hold as much of their circles as a prism does of its cylinder.
      {"torus", 2 * pi * 0.5 * 0.01 * 6 * std::sin(pi / 6) * std::sin(2 * pi / 64) / (2 * pi / 64), 1e-5,
       [](Shapes& s) {
         s.torus({1, 1, 1}, 0.5f, 0.2f, 0, 64);
       }},
      {"ellipsoid", 4.0 / 3 * pi * 0.5 * 0.25 * 0.75, 4.0 / 3 * pi * 0.5 * 0.25 * 0.75 * of_facets,
       [](Shapes& s) {
         s.blob({1, 1, 1}, {0.5f, 0.25f, 0.75f}, 0, 1, 0, 40);
       }},
      {"mesh of a sphere", 4.0 / 3 * pi * 0.125, 4.0 / 3 * pi * 0.125 * of_facets,
       [](Shapes& s) {
         s.mesh({"sphere", sphere_mesh({0, 0, 0}, 1, 40)}, {1, 1, 1}, 1, 0);
       }},
      // A cushion: the box shrunk by the radius, plus slabs, quarter cylinders and an eighth sphere at each corner.
      {"cushion",
       0.8 * 0.4 * 0.2 + 2 * 0.1 * (0.8 * 0.4 + 0.4 * 0.2 + 0.8 * 0.2) + pi * 0.01 * (0.8 + 0.4 + 0.2) +
           4.0 / 3 * pi * 1e-3,
       2e-3,  // quarter circles of six facets have 1.1 % less area
       [](Shapes& s) {
         s.cushion({0, 0, 0}, {1, 0.6f, 0.4f}, 0.1f, 0, 6);
       }},
  };
  for (const Solid& solid : solids) {
    World scene;
    Shapes shapes(scene, glm::mat4(1), Random(3));
    solid.build(shapes);
    EXPECT_NEAR(volume(scene), solid.volume, solid.tolerance) << solid.name;
    EXPECT_EQ(open_edges(scene), 0) << solid.name;
    glm::vec3 sum(0);
    for (const Triangle& t : scene.triangles) {
      sum += face_cross(t);
      if (!t.smooth) continue;
      for (const Vertex& v : t.v) {
        EXPECT_NEAR(glm::length(v.normal), 1, 8 * kFloatRounding) << solid.name;
        if (glm::length(face_cross(t)) < 1e-9f) continue;
        EXPECT_GT(glm::dot(v.normal, glm::normalize(face_cross(t))), 0.5f) << solid.name;
      }
    }
    EXPECT_LT(glm::length(sum), 1e-4f) << solid.name << ": faces of a closed solid sum to nothing";
  }
}

TEST(Shapes, SpheresHaveTheNormalsOfSpheres) {
  World scene;
  Shapes(scene, glm::mat4(1), Random(3)).sphere({1, 2, 3}, 0.5f, 0, 24);
  ASSERT_FALSE(scene.triangles.empty());
  for (const Triangle& t : scene.triangles) {
    for (const Vertex& v : t.v)
      EXPECT_LT(glm::length(v.normal - (v.position - glm::vec3(1, 2, 3)) / 0.5f), 16 * 3 * kFloatRounding);
  }
}

// Normals of what is turned, dented or crumpled are those of the surface that the facets stand for: of many facets.
TEST(Shapes, SmoothOnesHaveTheNormalsOfTheirFacets) {
  const auto farthest = [](auto&& build) {
    World scene;
    Shapes shapes(scene, glm::mat4(1), Random(3));
    build(shapes);
    float least = 1;
    for (const Triangle& t : scene.triangles) {
      if (glm::length(face_cross(t)) < 1e-9f) continue;
      for (const Vertex& v : t.v) least = std::min(least, glm::dot(v.normal, glm::normalize(face_cross(t))));
    }
    EXPECT_FALSE(scene.triangles.empty());
    return least;
  };
  EXPECT_GT(farthest([](Shapes& s) {
              s.torus({0, 0, 0}, 0.5f, 0.2f, 0, 200);
            }),
            std::cos(std::numbers::pi_v<float> / 11));
  EXPECT_GT(farthest([](Shapes& s) { s.blob({0, 0, 0}, {0.5f, 0.4f, 0.3f}, 0.4f, 2, 0, 120); }), 0.97f);
  EXPECT_GT(farthest([](Shapes& s) { s.cloth({0, 0, 0}, {1, 0.2f, 1}, 0, 200); }), 0.97f);
}

TEST(Shapes, DiscsLookDown) {
  World scene;
  Shapes(scene, glm::mat4(1), Random(3)).disc({1, 2, 3}, 0.5f, 0, 64);
  glm::vec3 twice_area(0);
  for (const Triangle& t : scene.triangles) twice_area += face_cross(t);
  EXPECT_NEAR(twice_area.y / 2, -0.25 * 32 * std::sin(2 * std::numbers::pi / 64), 2e-6);
}

TEST(Shapes, TransformsMoveAndTurn) {
  World scene;
  Shapes s(scene, glm::mat4(1), Random(3));
  s.at({1, 0, 0}, std::numbers::pi_v<float> / 2).block({0, 0, 1}, {0.1f, 0.1f, 0.1f}, 0);  // +z turns to +x
  for (const Triangle& t : scene.triangles) {
    for (const Vertex& v : t.v) EXPECT_LT(glm::length(v.position - glm::vec3(2, 0.05f, 0)), 0.1f);
  }
}

}  // namespace
}  // namespace clerestory
