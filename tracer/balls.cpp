#include "tracer/balls.hpp"

#include <algorithm>

#include "tracer/probes.hpp"

namespace clerestory {
namespace {

constexpr int kAttempts = 200;

}  // namespace

const std::vector<BallKind>& ball_kinds() {
  static const std::vector<BallKind> kinds = {
      {"mirror", 0.9f, 0.02f, 1}, {"glossy", 0.9f, 0.2f, 1}, {"diffuse", 0.8f, 1, 0}};
  return kinds;
}

std::optional<BallPlace> place_ball(TraceScene& scene, const World& world, const Camera& camera, Random random) {
  const TraceMaps maps = scene.maps(camera);
  const std::size_t pixels = maps.depth.pixels();
  const Vec3 up = camera.direction_to_camera({0, 1, 0});
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const int x = random.whole(camera.width / 5, camera.width * 4 / 5),
              y = random.whole(camera.height / 3, camera.height * 9 / 10);
    const std::size_t at = static_cast<std::size_t>(y) * camera.width + x;
    const double depth = static_cast<double>(maps.depth.data[at]);
    const Vec3 normal(maps.normal.data[at], maps.normal.data[pixels + at], maps.normal.data[2 * pixels + at]);
    if (depth < 0.6 || glm::dot(normal, up) < 0.99) continue;
    const double radius = std::clamp(depth * camera.height / camera.fy / 9, 0.04, 0.4);
    const Vec3 center = camera.unproject(x + 0.5, y + 0.5, depth) + (kBallLift * radius) * up;
    const auto at_center = camera.project(center);
    const double margin = 1.2 * radius * camera.fy / -center.z;
    if (!at_center || at_center->x < margin || at_center->x > camera.width - margin || at_center->y < margin ||
        at_center->y > camera.height - margin) {
      continue;
    }
    if (distance_to_surface(world, camera.to_world(center)) < radius) continue;
    return BallPlace{center, radius};
  }
  return std::nullopt;
}

Material uniform_material(const glm::vec3& albedo, float roughness, float metallic) {
  Material m;
  m.color_a = m.color_b = m.color_c = albedo;
  m.roughness_a = m.roughness_b = m.roughness_c = roughness;
  m.metallic_a = m.metallic_b = m.metallic_c = metallic;
  m.uncapped = 1;
  return m;
}

World with_mesh(const World& scene, const Camera& camera, const Mesh& mesh, const Material& material) {
  World more = scene;
  const int number = static_cast<int>(more.materials.size());
  more.materials.push_back(material);
  const auto vertex = [&](std::uint32_t i) {
    const auto& p = mesh.positions[i];
    const auto& n = mesh.normals[i];
    return Vertex{glm::vec3(camera.to_world({p[0], p[1], p[2]})), glm::vec3(0),
                  glm::vec3(camera.direction_to_world({n[0], n[1], n[2]}))};
  };
  for (const auto& [a, b, c] : mesh.indices)
    more.triangles.push_back({.v = {vertex(a), vertex(b), vertex(c)}, .material = number, .smooth = true});
  return more;
}

World with_ball(const World& scene, const Camera& camera, const BallPlace& place, const BallKind& kind) {
  World more = scene;
  Shapes shapes(more, glm::mat4(1), Random(0));
  const Material m = uniform_material(glm::vec3(kind.albedo), kind.roughness, kind.metallic);
  // 48 rings: the facets lie within 2e-3 of the radius of the true sphere, reflections follow the exact normals.
  shapes.sphere(glm::vec3(camera.to_world(place.center)), static_cast<float>(place.radius), shapes.material(m), 48);
  return more;
}

}  // namespace clerestory
