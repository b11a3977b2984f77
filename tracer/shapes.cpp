#include "tracer/shapes.hpp"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

namespace clerestory {
namespace {

glm::vec3 random_shift(Random& random) {
  return {random.between(-50, 50), random.between(-50, 50), random.between(-50, 50)};
}

std::vector<float> numbers_of(std::initializer_list<glm::vec3> points, std::initializer_list<float> more = {}) {
  std::vector<float> numbers;
  for (const glm::vec3& p : points) numbers.insert(numbers.end(), {p.x, p.y, p.z});
  numbers.insert(numbers.end(), more);
  return numbers;
}

}  // namespace

Shapes::Shapes(World& scene, const glm::mat4& to_room, Random random, std::vector<Part>* record)
    : scene_(&scene), record_(record), to_room_(to_room), random_(random) {}

Shapes Shapes::at(const glm::mat4& local) {
  return Shapes(*scene_, to_room_ * local, random_.fork(random_.bits()), record_);
}

Shapes Shapes::at(const glm::vec3& offset, float turn_about_y) {
  return at(glm::rotate(glm::translate(glm::mat4(1), offset), turn_about_y, glm::vec3(0, 1, 0)));
}

int Shapes::material(const Material& material) {
  scene_->materials.push_back(material);
  return static_cast<int>(scene_->materials.size()) - 1;
}

int Shapes::emitter(const Emitter& emitter) {
  scene_->emitters.push_back(emitter);
  return static_cast<int>(scene_->emitters.size()) - 1;
}

void Shapes::add(Part part, const Mesh* mesh) {
  part.to_room = to_room_;
  add_part(*scene_, part, mesh);
  if (record_) record_->push_back(std::move(part));
}

void Shapes::quad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, int material,
                  int emitter, const glm::vec2& uv) {
  add({.kind = PartKind::Quad,
       .numbers = numbers_of({a, b, c, d}, {uv.x, uv.y}),
       .material = material,
       .emitter = emitter});
}

void Shapes::canvas(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, int material) {
  add({.kind = PartKind::Canvas, .numbers = numbers_of({a, b, c, d}), .material = material});
}

void Shapes::box(const glm::vec3& low, const glm::vec3& high, int material) {
  add({.kind = PartKind::Box,
       .numbers = numbers_of({low, high}),
       .material = material,
       .shift = random_shift(random_)});
}

void Shapes::block(const glm::vec3& base, const glm::vec3& size, int material) {
  const glm::vec3 half(size.x / 2, 0, size.z / 2);
  box(base - half, base + half + glm::vec3(0, size.y, 0), material);
}

void Shapes::cushion(const glm::vec3& low, const glm::vec3& high, float radius, int material, int steps) {
  add({.kind = PartKind::Cushion,
       .numbers = numbers_of({low, high}, {radius}),
       .steps = steps,
       .material = material,
       .shift = random_shift(random_)});
}

void Shapes::rings(PartKind kind, const glm::vec3& base, const std::vector<glm::vec2>& profile, int material, int sides,
                   int emitter, bool open) {
  std::vector<float> numbers = numbers_of({base});
  for (const glm::vec2& ring : profile) numbers.insert(numbers.end(), {ring.x, ring.y});
  add({.kind = kind,
       .numbers = std::move(numbers),
       .steps = sides,
       .material = material,
       .emitter = emitter,
       .open = open,
       .shift = random_shift(random_)});
}

void Shapes::lathe(const glm::vec3& base, const std::vector<glm::vec2>& profile, int material, int sides, int emitter,
                   bool open) {
  rings(PartKind::Lathe, base, profile, material, sides, emitter, open);
}

void Shapes::turned(const glm::vec3& base, const std::vector<glm::vec2>& profile, int material, int sides, int emitter,
                    bool open) {
  rings(PartKind::Turned, base, profile, material, sides, emitter, open);
}

void Shapes::torus(const glm::vec3& center, float radius, float thickness, int material, int sides, int emitter) {
  constexpr int section = 12;
  std::vector<glm::vec2> profile;
  for (int i = 0; i <= section; ++i) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(i % section) / section;
    profile.push_back({radius + thickness / 2 * std::cos(angle), thickness / 2 * std::sin(angle)});
  }
  turned(center, profile, material, sides, emitter, true);
}

void Shapes::blob(const glm::vec3& center, const glm::vec3& radii, float depth, float waves, int material, int steps) {
  const auto noise = static_cast<float>(random_.whole(0, 65535));
  add({.kind = PartKind::Blob,
       .numbers = numbers_of({center, radii}, {depth, waves, noise}),
       .steps = steps,
       .material = material,
       .shift = random_shift(random_)});
}

void Shapes::cloth(const glm::vec3& foot, const glm::vec3& size, int material, int steps) {
  const auto noise = static_cast<float>(random_.whole(0, 65535));
  add({.kind = PartKind::Cloth,
       .numbers = numbers_of({foot}, {size.x, size.z, size.y, noise}),
       .steps = steps,
       .material = material,
       .shift = random_shift(random_)});
}

void Shapes::cylinder(const glm::vec3& base, float radius, float height, int material, int sides) {
  lathe(base, {{radius, 0}, {radius, height}}, material, sides);
}

void Shapes::disc(const glm::vec3& center, float radius, int material, int sides, int emitter) {
  add({.kind = PartKind::Disc,
       .numbers = numbers_of({center}, {radius}),
       .steps = sides,
       .material = material,
       .emitter = emitter});
}

void Shapes::rod(const glm::vec3& from, const glm::vec3& to, float thickness, int material) {
  const glm::vec3 along = to - from;
  const float length = glm::length(along);
  const glm::vec3 z = along / length;
  const glm::vec3 x = glm::normalize(glm::cross(std::abs(z.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0), z));
  glm::mat4 local(1);
  local[0] = glm::vec4(x, 0);
  local[1] = glm::vec4(glm::cross(z, x), 0);
  local[2] = glm::vec4(z, 0);
  local[3] = glm::vec4(from, 1);
  const float h = thickness / 2;
  at(local).box({-h, -h, 0}, {h, h, length}, material);
}

void Shapes::sphere(const glm::vec3& center, float radius, int material, int steps, int emitter) {
  add({.kind = PartKind::Sphere,
       .numbers = numbers_of({center}, {radius}),
       .steps = steps,
       .material = material,
       .emitter = emitter,
       .shift = random_shift(random_)});
}

void Shapes::mesh(const Model& model, const glm::vec3& base, float height, int material) {
  add({.kind = PartKind::Mesh,
       .numbers = numbers_of({base}, {height}),
       .material = material,
       .model = model.name,
       .shift = random_shift(random_)},
      &model.mesh);
}

void Shapes::curtain(const glm::vec3& low, float width, float height, float fold, int folds, int material) {
  add({.kind = PartKind::Curtain,
       .numbers = numbers_of({low}, {width, height, fold}),
       .steps = folds,
       .material = material,
       .shift = random_shift(random_)});
}

void Shapes::tube(const std::vector<glm::vec3>& points, float radius, int material, int sides) {
  std::vector<float> numbers{radius};
  for (const glm::vec3& p : points) numbers.insert(numbers.end(), {p.x, p.y, p.z});
  add({.kind = PartKind::Tube,
       .numbers = std::move(numbers),
       .steps = sides,
       .material = material,
       .shift = random_shift(random_)});
}

}  // namespace clerestory
