// Solids of no particular use, in any pose; and packages, clothes, cartons and cables, which lie about where people
// live.
#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "tracer/furniture.hpp"

namespace clerestory {
namespace {

constexpr float kTurn = 6.2832f;

/// A pose in which a box of that size about the origin has its lowest corner at y = 0: upright, on its side, or any.
glm::mat4 rest(const glm::vec3& size, Random& r) {
  glm::mat4 turn = glm::rotate(glm::mat4(1), r.between(0, kTurn), {0, 1, 0});
  const float pose = r.unit();
  if (pose > 0.55f && pose < 0.8f) turn = glm::rotate(turn, kTurn / 4, {0, 0, 1});
  if (pose >= 0.8f)
    turn = glm::rotate(turn, r.between(0, kTurn), glm::normalize(glm::vec3(r.between(-1, 1), 0.1f, r.between(-1, 1))));
  float low = 0;
  for (int axis = 0; axis < 3; ++axis) low += std::abs(turn[axis].y) * size[axis] / 2;
  return glm::translate(glm::mat4(1), {0, low, 0}) * turn;
}

/// Radii that wander between rings.
std::vector<glm::vec2> random_profile(float radius, float height, Random& r) {
  const int rings = r.whole(2, 7);
  std::vector<glm::vec2> profile;
  for (int i = 0; i <= rings; ++i)
    profile.push_back(
        {radius * r.between(0.15f, 1), height * (static_cast<float>(i) / static_cast<float>(rings) - 0.5f)});
  if (r.chance(0.3f)) profile.back().x = 0;
  return profile;
}

/// Within a box of that size about the origin.
void solid_in(Shapes& s, const glm::vec3& size, int m) {
  Random& r = s.random();
  const glm::vec3 half = size * 0.5f;
  const float round = std::min(half.x, half.z);
  switch (r.whole(0, 8)) {
    case 0:
      return s.box(-half, half, m);
    case 1:
      return s.cushion(-half, half, r.between(0.1f, 0.9f) * std::min(half.y, round), m, 3);
    case 2:
      return s.lathe({0, 0, 0}, random_profile(round, size.y, r), m, r.whole(12, 24));
    case 3:
    case 4:
      return s.turned({0, 0, 0}, random_profile(round, size.y, r), m, 20);
    case 5: {
      const float thickness = std::min(size.y, round * r.between(0.2f, 0.9f));
      return s.torus({0, 0, 0}, round - thickness / 2, thickness, m);
    }
    case 6:
      return s.blob({0, 0, 0}, half, 0, 1, m, 12);
    case 7:
      return s.blob({0, 0, 0}, half, r.between(0.15f, 0.6f), r.between(1, 4), m, 18);
    default: {
      std::vector<glm::vec3> points;
      for (int i = r.whole(3, 7); i >= 0; --i)
        points.push_back(half * glm::vec3(r.between(-0.8f, 0.8f), r.between(-0.8f, 0.8f), r.between(-0.8f, 0.8f)));
      return s.tube(points, r.between(0.05f, 0.2f) * std::min(half.y, round), m, 8);
    }
  }
}

/// Longest side, the others down to a fifth of it.
glm::vec3 random_size(float longest, Random& r) {
  glm::vec3 size(longest * r.between(0.2f, 1), longest * r.between(0.2f, 1), longest * r.between(0.2f, 1));
  size[r.whole(0, 2)] = longest;
  return size;
}

Material solid_material(const Kit& kit, Random& r) {
  const float kind = r.unit();
  if (kind < 0.4f) return kit.palette->anything();
  if (kind < 0.55f) return kit.palette->metal();
  return kit.palette->trinket();
}

void bottle_with_label(Shapes& s, const Kit& kit, float room) {
  Random& r = s.random();
  const float h = std::min(room, r.between(0.12f, 0.34f)), radius = h * r.between(0.13f, 0.26f),
              neck = radius * r.between(0.25f, 0.6f);
  const float shoulder = r.between(0.55f, 0.75f) * h, top = r.between(0.8f, 0.9f) * h;
  s.turned({0, 0, 0}, {{radius * 0.9f, 0}, {radius, 0.03f * h}, {radius, shoulder}, {neck, top}, {neck, h * 0.93f}},
           s.material(kit.palette->make(MaterialClass::Plastic)), 18);
  s.cylinder({0, top, 0}, neck * 1.15f, h - top, s.material(kit.palette->make(MaterialClass::Plastic)), 14);
  const float low = r.between(0.08f, 0.25f) * h;
  s.lathe({0, low, 0}, {{radius * 1.01f, 0}, {radius * 1.01f, (shoulder - low) * r.between(0.5f, 0.9f)}},
          s.material(kit.palette->label()), 18, -1, true);
  if (r.chance(0.3f))  // a jug's handle
    s.tube({{radius * 0.8f, shoulder * 0.95f, 0},
            {radius * 1.7f, shoulder * 0.95f, 0},
            {radius * 1.7f, shoulder * 0.5f, 0},
            {radius * 0.9f, shoulder * 0.35f, 0}},
           radius * 0.2f, s.material(kit.palette->make(MaterialClass::Plastic)), 8);
}

/// A brown box, taped, or open with its flaps up.
void carton(Shapes& s, const Kit& kit, const glm::vec3& size) {
  Random& r = s.random();
  const int board = s.material(kit.palette->cardboard());
  const float x = size.x / 2, z = size.z / 2, h = size.y, thick = 0.005f;
  if (r.chance(0.6f)) {
    s.block({0, 0, 0}, size, board);
    const int tape = s.material(kit.palette->make(MaterialClass::Plastic));
    s.box({-x - 0.0005f, h, -0.025f}, {x + 0.0005f, h + 0.0006f, 0.025f}, tape);
    if (r.chance(0.6f)) {
      const float w = x * r.between(0.3f, 0.8f), y = h * r.between(0.15f, 0.4f);
      s.quad({-w, y, z + 0.0006f}, {w, y, z + 0.0006f}, {w, h * 0.85f, z + 0.0006f}, {-w, h * 0.85f, z + 0.0006f},
             s.material(kit.palette->label()));
    }
    return;
  }
  s.box({-x, 0, -z}, {x, thick, z}, board);
  for (const float side : {-1.f, 1.f}) {
    s.box({std::min(side * x, side * (x - thick)), thick, -z}, {std::max(side * x, side * (x - thick)), h, z}, board);
    s.box({-x + thick, thick, std::min(side * z, side * (z - thick))},
          {x - thick, h, std::max(side * z, side * (z - thick))}, board);
    const glm::mat4 flap =
        glm::rotate(glm::translate(glm::mat4(1), {side * x, h, 0}), side * r.between(-1.2f, 0.6f), {0, 0, 1});
    s.at(flap).box({-thick / 2, 0, -z}, {thick / 2, size.z * 0.45f, z}, board);
  }
}

}  // namespace

void printed_box(Shapes& s, const Kit& kit, const glm::vec3& size) {
  const glm::vec3 half(size.x / 2, 0, size.z / 2);
  s.block({0, 0, 0}, size,
          s.material(s.random().chance(0.5f) ? kit.palette->make(MaterialClass::Paper) : kit.palette->cardboard()));
  const int front = s.material(kit.palette->label()), top = s.material(kit.palette->label());
  constexpr float out = 0.0006f;
  const float x = half.x * 0.97f, y0 = size.y * 0.04f, y1 = size.y * 0.96f;
  s.quad({-x, y0, half.z + out}, {x, y0, half.z + out}, {x, y1, half.z + out}, {-x, y1, half.z + out}, front);
  s.quad({x, y0, -half.z - out}, {-x, y0, -half.z - out}, {-x, y1, -half.z - out}, {x, y1, -half.z - out}, front);
  s.quad({-x, size.y + out, half.z}, {x, size.y + out, half.z}, {x, size.y + out, -half.z}, {-x, size.y + out, -half.z},
         top);
}

void random_solid(Shapes& s, const Kit& kit, float most, float room) {
  Random& r = s.random();
  const glm::vec3 size = random_size(std::min(r.log_between(0.25f * most, most), room * 0.7f), r);
  const int m = s.material(solid_material(kit, r));
  Shapes at = s.at(rest(size, r));
  solid_in(at, size, m);
}

void package(Shapes& s, const Kit& kit, float room) {
  Random& r = s.random();
  const float kind = r.unit();
  if (kind < 0.4f && room > 0.12f) return bottle_with_label(s, kit, room);
  if (kind < 0.85f)
    return printed_box(s, kit,
                       {r.between(0.06f, 0.2f), std::min(room, r.between(0.04f, 0.26f)), r.between(0.03f, 0.15f)});
  const glm::vec3 bag(r.between(0.12f, 0.22f), std::min(room, r.between(0.1f, 0.24f)), r.between(0.06f, 0.12f));
  s.blob({0, bag.y / 2, 0}, bag * 0.5f, 0.25f, 3, s.material(kit.palette->label()), 16);
}

Piece solids(const Kit& kit, Random& random) {
  const float most = random.log_between(0.1f, 0.75f);
  const int count = most > 0.35f ? 1 : random.whole(1, 3);
  const float wide = 1.75f * most;  // the longest diagonal
  return {"solids", {wide, wide, wide * static_cast<float>(count)}, [=](Shapes& s) {
            for (int i = 0; i < count; ++i) {
              Shapes one = s.at({0, 0, wide * (static_cast<float>(i) + 0.5f - 0.5f * static_cast<float>(count))});
              random_solid(one, kit, most, 2 * most);
            }
          }};
}

Piece cartons(const Kit& kit, Random& random) {
  const glm::vec3 size(random.between(0.25f, 0.6f), random.between(0.18f, 0.45f), random.between(0.2f, 0.45f));
  const float turn = random.between(-0.15f, 0.15f);
  const bool second = random.chance(0.35f);
  return {"cartons", {size.x * 1.9f, size.y * 2, size.z * 1.3f + 0.1f}, [=](Shapes& whole) {
            Shapes s = whole.at({0, 0, 0}, turn);
            carton(s, kit, size);
            if (!second) return;
            Shapes on = s.at({0, size.y + 0.001f, 0}, 2 * turn);
            printed_box(on, kit, size * glm::vec3(0.7f, 0.6f, 0.7f));
          }};
}

Piece garment(const Kit& kit, Random& random) {
  const float w = random.between(0.4f, 0.9f), d = random.between(0.35f, 0.7f), h = random.between(0.05f, 0.2f);
  const Material cloth = random.chance(0.5f) ? kit.palette->print() : kit.palette->make(MaterialClass::Fabric);
  return {"garment", {w, h, d}, [=](Shapes& s) { s.cloth({0, 0.001f, 0}, {w, h, d}, s.material(cloth)); }};
}

Piece cable(const Kit& kit, Random& random) {
  const float length = random.between(0.6f, 1.1f), thick = random.between(0.003f, 0.006f);
  const Material skin = kit.palette->make(MaterialClass::Plastic);
  return {"cable", {length, 0.02f, 0.6f}, [=](Shapes& s) {
            Random& r = s.random();
            const float waves = r.between(0.5f, 2), swing = r.between(0.05f, 0.25f), phase = r.between(0, kTurn);
            std::vector<glm::vec3> points;
            for (int i = 0; i <= 20; ++i) {
              const float t = static_cast<float>(i) / 20;
              points.push_back(
                  {length * (t - 0.5f), thick, swing * std::sin(kTurn * waves * t * (0.6f + 0.4f * t) + phase)});
            }
            s.tube(points, thick, s.material(skin), 6);
          }};
}

Piece packages(const Kit& kit, Random& random) {
  const int count = random.whole(1, 4);
  return {"packages", {0.28f * static_cast<float>(count), 0.35f, 0.3f}, [=](Shapes& s) {
            for (int i = 0; i < count; ++i) {
              const float x = 0.28f * (static_cast<float>(i) + 0.5f - 0.5f * static_cast<float>(count));
              Shapes one = s.at({x, 0, 0}, s.random().between(0, kTurn));
              package(one, kit, 0.34f);
            }
          }};
}

Piece clothes_rack(const Kit& kit, Random& random) {
  const float w = random.between(0.8f, 1.4f), h = random.between(1.3f, 1.7f);
  const Material metal = kit.palette->chrome();
  const int count = random.whole(3, 9);
  return {"clothes_rack", {w, h, 0.5f}, [=](Shapes& s) {
            const int m = s.material(metal);
            const float x = w / 2 - 0.02f;
            s.tube({{-x, 0, 0}, {-x, h - 0.02f, 0}, {x, h - 0.02f, 0}, {x, 0, 0}}, 0.013f, m, 8);
            for (const float side : {-x, x}) s.tube({{side, 0.014f, -0.22f}, {side, 0.014f, 0.22f}}, 0.013f, m, 8);
            for (int i = 0; i < count; ++i) {
              Random& r = s.random();
              const float at = (w - 0.16f) * ((static_cast<float>(i) + 0.5f) / static_cast<float>(count) - 0.5f);
              const float long_one = r.between(0.5f, h - 0.25f), wide = r.between(0.3f, 0.42f);
              const int cloth =
                  s.material(r.chance(0.4f) ? kit.palette->print() : kit.palette->make(MaterialClass::Fabric));
              Shapes one = s.at({at, 0, 0}, kTurn / 4 + r.between(-0.25f, 0.25f));
              one.curtain({-wide / 2, h - 0.08f - long_one, 0}, wide, long_one, r.between(0.01f, 0.03f), r.whole(1, 4),
                          cloth);
            }
          }};
}

Piece screen(const Kit& kit, Random& random) {
  const float w = random.between(0.9f, 1.7f), h = random.between(1.f, 1.7f);
  const Material panel = random.chance(0.5f) ? kit.palette->make(MaterialClass::Fabric) : kit.palette->body();
  const Material frame = kit.palette->metal();
  return {"screen", {w, h, 0.4f}, [=](Shapes& s) {
            const int p = s.material(panel), f = s.material(frame);
            s.box({-w / 2, 0.12f, -0.018f}, {w / 2, h, 0.018f}, p);
            for (const float x : {-w / 2, w / 2 - 0.03f}) {
              s.box({x, 0, -0.02f}, {x + 0.03f, h, 0.02f}, f);
              s.box({x, 0, -0.2f}, {x + 0.03f, 0.03f, 0.2f}, f);
            }
          }};
}

Piece column(const Kit& kit, Random& random, float height) {
  const float w = random.between(0.12f, 0.45f), h = height - 0.001f;
  const bool round = random.chance(0.4f);
  const Material face = random.chance(0.6f) ? kit.palette->wall() : kit.palette->make(MaterialClass::Concrete);
  return {"column", {w, h, w}, [=](Shapes& s) {
            const int m = s.material(face);
            if (round) return s.cylinder({0, 0, 0}, w / 2, h, m, 24);
            s.block({0, 0, 0}, {w, h, w}, m);
          }};
}

}  // namespace clerestory
