// Small scenes and helpers that several tests use.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "host/cl/device.hpp"
#include "tracer/shapes.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

inline Device& test_device() {
  static Device device = Device::open();
  return device;
}

inline Material plain(const glm::vec3& albedo, float roughness, float metallic = 0) {
  Material m;
  m.color_a = m.color_b = m.color_c = albedo;
  m.roughness_a = m.roughness_b = m.roughness_c = roughness;
  m.metallic_a = m.metallic_b = m.metallic_c = metallic;
  m.uncapped = 1;
  return m;
}

/// Turns every triangle over: what looked outwards looks inwards.
inline void turn_inside_out(World& scene) {
  for (Triangle& t : scene.triangles) {
    std::swap(t.v[1], t.v[2]);
    for (Vertex& v : t.v) v.normal = -v.normal;
  }
}

/// A closed sphere of radius 2 seen from inside, each point of which emits 1 and reflects.
inline World furnace(const Material& material) {
  World scene;
  Shapes shapes(scene, glm::mat4(1), Random(1));
  const int m = shapes.material(material), e = shapes.emitter({glm::vec3(1), false});
  shapes.sphere({0, 0, 0}, 2, m, 40, e);
  turn_inside_out(scene);
  return scene;
}

/// A closed room with a lamp and a block, all rough and without textures: paths of much alike brightness.
inline World plain_room() {
  World scene;
  Shapes shapes(scene, glm::mat4(1), Random(1));
  const int wall = shapes.material(plain({0.7f, 0.5f, 0.3f}, 1));
  shapes.box({-2, 0, -2}, {2, 2.5f, 2}, wall);
  turn_inside_out(scene);
  shapes.box({-1.2f, 0, -1.2f}, {-0.4f, 0.9f, -0.5f}, shapes.material(plain(glm::vec3(0.6f), 0.8f)));
  const int lamp = shapes.emitter({{6, 5, 4}, false});
  shapes.quad({-0.6f, 2.49f, -0.6f}, {0.6f, 2.49f, -0.6f}, {0.6f, 2.49f, 0.6f}, {-0.6f, 2.49f, 0.6f}, wall, lamp);
  return scene;
}

/// A wall at z = -2 of tiles of 2 cm, dark with white joints of a third of the area or so, before a glowing one at z
/// = 2.
inline World tiled_wall_before_lamp() {
  World scene;
  Shapes shapes(scene, glm::mat4(1), Random(1));
  Material tiles = plain(glm::vec3(0.05f), 1);
  tiles.color_c = glm::vec3(0.9f);
  tiles.texture = static_cast<float>(Texture::Tiles);
  tiles.scale = glm::vec3(50.f), tiles.gap = 0.1f;
  const int wall = shapes.material(tiles), lamp = shapes.emitter({glm::vec3(1), false});
  shapes.quad({-9, -9, -2}, {9, -9, -2}, {9, 9, -2}, {-9, 9, -2}, wall);
  shapes.quad({9, -9, 2}, {-9, -9, 2}, {-9, 9, 2}, {9, 9, 2}, wall, lamp);
  return scene;
}

/// Standard deviation over mean.
inline double relative_spread(const std::vector<double>& values) {
  double sum = 0, squares = 0;
  for (const double v : values) sum += v, squares += v * v;
  const double n = static_cast<double>(values.size()), mean = sum / n;
  return std::sqrt(std::max(0.0, squares / n - mean * mean)) / mean;
}

/// count copies of one ray, planar.
inline std::vector<float> repeated(const glm::vec3& v, int count) {
  std::vector<float> planar(3 * static_cast<std::size_t>(count));
  for (int c = 0; c < 3; ++c) std::fill_n(planar.begin() + static_cast<std::ptrdiff_t>(c) * count, count, v[c]);
  return planar;
}

struct Estimate {
  double mean[3] = {0, 0, 0}, error[3] = {0, 0, 0};  // standard error of the mean
};

/// Radiance along one ray from `rays` independent estimates.
inline Estimate estimate(TraceScene& scene, const glm::vec3& point, const glm::vec3& direction, int rays,
                         const RadianceQuery& query) {
  const std::vector<float> l = scene.radiance(repeated(point, rays), repeated(direction, rays), query);
  Estimate e;
  for (int c = 0; c < 3; ++c) {
    double sum = 0, squares = 0;
    for (int i = 0; i < rays; ++i) {
      const double v = static_cast<double>(l[static_cast<std::size_t>(c) * rays + i]);
      sum += v, squares += v * v;
    }
    e.mean[c] = sum / rays;
    e.error[c] = std::sqrt(std::max(0.0, squares / rays - e.mean[c] * e.mean[c]) / (rays - 1));
  }
  return e;
}

}  // namespace clerestory
