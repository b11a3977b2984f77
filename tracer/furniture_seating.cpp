// Chairs, sofas, beds.
#include <algorithm>

#include "tracer/furniture.hpp"

namespace clerestory {
namespace {

void legs(Shapes& s, float x, float z, float height, float thickness, int material, bool round) {
  for (const float sx : {-1.f, 1.f}) {
    for (const float sz : {-1.f, 1.f}) {
      const glm::vec3 base(sx * (x - thickness / 2), 0, sz * (z - thickness / 2));
      if (round)
        s.cylinder(base, thickness / 2, height, material, 10);
      else
        s.block(base, {thickness, height, thickness}, material);
    }
  }
}

}  // namespace

namespace {
Piece tube_chair(const Kit& kit, Random& random);
}

Piece chair(const Kit& kit, Random& random) {
  if (random.chance(0.25f)) return tube_chair(kit, random);
  const float w = random.between(0.4f, 0.48f), d = random.between(0.42f, 0.5f), seat = random.between(0.43f, 0.48f);
  const float back = random.between(0.82f, 1.0f), leg = random.between(0.028f, 0.045f);
  const bool padded = random.chance(0.5f), round = random.chance(0.4f), slats = random.chance(0.5f);
  const Material frame = random.chance(0.65f)  ? kit.palette->wood()
                         : random.chance(0.5f) ? kit.palette->metal()
                                               : kit.palette->make(MaterialClass::Plastic);
  const Material soft = random.chance(0.65f) ? kit.palette->fabric() : kit.palette->make(MaterialClass::Leather);
  return {"chair", {w, back, d}, [=](Shapes& s) {
            const int f = s.material(frame), c = padded ? s.material(soft) : f;
            legs(s, w / 2, d / 2, seat - 0.03f, leg, f, round);
            s.box({-w / 2, seat - 0.035f, -d / 2}, {w / 2, seat, d / 2}, f);
            if (padded)
              s.cushion({-w / 2 + 0.01f, seat, -d / 2 + 0.03f}, {w / 2 - 0.01f, seat + 0.05f, d / 2}, 0.024f, c, 2);
            for (const float sx : {-1.f, 1.f}) {
              const float x = sx * (w - leg) / 2;
              s.rod({x, seat, -d / 2 + leg / 2}, {x, back, -d / 2 - 0.03f}, leg, f);
            }
            const float z = -d / 2 - 0.005f;
            if (padded && !slats) {
              s.cushion({-w / 2 + leg, seat + 0.12f, z - 0.02f}, {w / 2 - leg, back, z + 0.03f}, 0.022f, c, 2);
            } else {
              const int n = 3;
              for (int i = 0; i < n; ++i) {
                const float y = seat + (back - seat) * (0.4f + 0.27f * static_cast<float>(i));
                s.box({-w / 2 + leg / 2, y - 0.03f, z - 0.012f}, {w / 2 - leg / 2, y + 0.03f, z + 0.008f}, f);
              }
            }
          }};
}

namespace {

/// A chair of bent tube: seat and back of one material on a frame that runs along the floor.
Piece tube_chair(const Kit& kit, Random& random) {
  const float w = random.between(0.44f, 0.52f), d = random.between(0.46f, 0.54f), back = random.between(0.78f, 0.9f);
  const Material metal = kit.palette->chrome();
  const Material seat = random.chance(0.4f)   ? kit.palette->fabric()
                        : random.chance(0.5f) ? kit.palette->make(MaterialClass::Leather)
                                              : kit.palette->make(MaterialClass::Plastic);
  return {"chair", {w, back, d}, [=](Shapes& s) {
            const int m = s.material(metal), c = s.material(seat);
            const float r = 0.011f, x = w / 2 - r, z0 = -d / 2 + 0.03f, z1 = d / 2 - r;
            for (const float side : {-1.f, 1.f})
              s.tube({{side * x, r, z0},
                      {side * x, r, z1 - 0.05f},
                      {side * x, 0.05f, z1},
                      {side * x, 0.4f, z1},
                      {side * x, 0.44f, z1 - 0.05f},
                      {side * x, 0.44f, z0 + 0.04f},
                      {side * x, 0.48f, z0},
                      {side * x, back, z0 - 0.01f}},
                     r, m, 8);
            s.tube({{-x, r, z0}, {x, r, z0}}, r, m, 8);
            s.cushion({-w / 2 + 0.02f, 0.435f, z0 + 0.03f}, {w / 2 - 0.02f, 0.475f, z1 + r}, 0.018f, c, 2);
            s.cushion({-w / 2 + 0.02f, back - 0.26f, z0 - 0.02f}, {w / 2 - 0.02f, back, z0 + 0.02f}, 0.018f, c, 2);
          }};
}

}  // namespace

Piece pouffe(const Kit& kit, Random& random) {
  const float r = random.between(0.2f, 0.32f), h = random.between(0.3f, 0.42f);
  const bool round = random.chance(0.5f);
  const Material cloth = random.chance(0.35f)  ? kit.palette->print()
                         : random.chance(0.6f) ? kit.palette->fabric()
                                               : kit.palette->make(MaterialClass::Leather);
  return {"pouffe", {2 * r, h, 2 * r}, [=](Shapes& s) {
            const int m = s.material(cloth);
            if (round)
              s.lathe({0, 0, 0},
                      {{r * 0.9f, 0},
                       {r * 0.98f, 0.05f},
                       {r, h * 0.5f},
                       {r * 0.98f, h - 0.05f},
                       {r * 0.88f, h - 0.01f},
                       {r * 0.6f, h}},
                      m, 28);
            else
              s.cushion({-r, 0, -r}, {r, h, r}, 0.05f, m, 3);
          }};
}

Piece bench(const Kit& kit, Random& random) {
  const float w = random.between(0.8f, 1.5f), h = random.between(0.42f, 0.48f), d = random.between(0.32f, 0.4f);
  const Material frame = random.chance(0.6f) ? kit.palette->wood() : kit.palette->metal(), soft = kit.palette->fabric();
  const bool padded = random.chance(0.5f);
  return {"bench", {w, h + 0.06f, d}, [=](Shapes& s) {
            const int f = s.material(frame);
            legs(s, w / 2 - 0.03f, d / 2 - 0.02f, h - 0.04f, 0.045f, f, false);
            s.box({-w / 2, h - 0.04f, -d / 2}, {w / 2, h, d / 2}, f);
            if (padded)
              s.cushion({-w / 2 + 0.01f, h, -d / 2 + 0.01f}, {w / 2 - 0.01f, h + 0.06f, d / 2 - 0.01f}, 0.028f,
                        s.material(soft), 2);
          }};
}

Piece stool(const Kit& kit, Random& random) {
  const float r = random.between(0.15f, 0.2f), h = random.one_of({0.45f, 0.65f});
  const Material m = kit.palette->body(), frame = kit.palette->metal();
  return {"stool", {2 * r, h, 2 * r}, [=](Shapes& s) {
            s.lathe({0, h - 0.04f, 0}, {{r - 0.01f, 0}, {r, 0.01f}, {r, 0.03f}, {r - 0.01f, 0.04f}}, s.material(m), 24);
            const int f = s.material(frame);
            for (const float x : {-1.f, 1.f}) {
              for (const float z : {-1.f, 1.f}) {
                s.rod({x * r * 0.45f, h - 0.04f, z * r * 0.45f}, {x * r * 0.68f, 0, z * r * 0.68f}, 0.022f, f);
              }
            }
          }};
}

Piece office_chair(const Kit& kit, Random& random) {
  const Material soft = random.chance(0.6f) ? kit.palette->fabric() : kit.palette->make(MaterialClass::Leather);
  const Material frame = random.chance(0.5f) ? kit.palette->metal() : kit.palette->make(MaterialClass::Plastic);
  const float seat = random.between(0.44f, 0.52f), back = random.between(0.95f, 1.2f);
  return {"office_chair", {0.62f, back, 0.62f}, [=](Shapes& s) {
            const int f = s.material(frame), c = s.material(soft);
            for (int i = 0; i < 5; ++i) {
              const float a = 1.2566f * static_cast<float>(i);
              const glm::vec3 end(0.28f * std::sin(a), 0.05f, 0.28f * std::cos(a));
              s.rod({0, 0.09f, 0}, end, 0.035f, f);
              s.sphere(end - glm::vec3(0, 0.022f, 0), 0.028f, f, 5);
            }
            s.cylinder({0, 0.08f, 0}, 0.028f, seat - 0.12f, f, 10);
            s.cushion({-0.25f, seat - 0.06f, -0.24f}, {0.25f, seat + 0.03f, 0.25f}, 0.04f, c);
            s.cushion({-0.23f, seat + 0.16f, -0.27f}, {0.23f, back, -0.2f}, 0.035f, c);
            s.box({-0.03f, seat - 0.04f, -0.3f}, {0.03f, seat + 0.3f, -0.27f}, f);
            for (const float x : {-0.28f, 0.28f}) {
              s.box({x - 0.025f, seat + 0.17f, -0.15f}, {x + 0.025f, seat + 0.2f, 0.12f}, f);
              s.box({x - 0.012f, seat, -0.03f}, {x + 0.012f, seat + 0.17f, 0.01f}, f);
            }
          }};
}

Piece sofa(const Kit& kit, Random& random, float width) {
  const float d = random.between(0.8f, 0.95f), seat = random.between(0.38f, 0.45f), back = random.between(0.7f, 0.9f);
  const float arm = random.between(0.12f, 0.22f), arm_height = seat + random.between(0.12f, 0.22f);
  const int seats = std::max(1, static_cast<int>((width - 2 * arm) / 0.6f));
  const Material cover = random.chance(0.7f) ? kit.palette->fabric() : kit.palette->make(MaterialClass::Leather);
  const Material feet = kit.palette->wood();
  std::vector<Material> pillows;
  for (int i = random.whole(0, 4); i > 0; --i)
    pillows.push_back(random.chance(0.45f) ? kit.palette->print() : kit.palette->make(MaterialClass::Fabric));
  const bool throw_on = random.chance(0.3f);
  const Material blanket = random.chance(0.4f) ? kit.palette->print() : kit.palette->make(MaterialClass::Fabric);
  return {
      seats > 1 ? "sofa" : "armchair", {width, back, d}, [=](Shapes& s) {
        const int c = s.material(cover), f = s.material(feet);
        legs(s, width / 2 - 0.04f, d / 2 - 0.04f, 0.1f, 0.05f, f, true);
        s.cushion({-width / 2, 0.09f, -d / 2}, {width / 2, seat - 0.13f, d / 2}, 0.03f, c, 2);
        s.cushion({-width / 2, 0.1f, -d / 2}, {width / 2, back, -d / 2 + 0.2f}, 0.06f, c);
        for (const float x : {-1.f, 1.f}) {
          const float inner = x * (width / 2 - arm), outer = x * width / 2;
          s.cushion({std::min(inner, outer), 0.1f, -d / 2}, {std::max(inner, outer), arm_height, d / 2}, 0.05f, c);
        }
        const float each = (width - 2 * arm) / static_cast<float>(seats);
        for (int i = 0; i < seats; ++i) {
          const float x = -width / 2 + arm + each * static_cast<float>(i);
          s.cushion({x, seat - 0.14f, -d / 2 + 0.18f}, {x + each, seat, d / 2 + 0.01f}, 0.045f, c);
          s.cushion({x + 0.01f, seat, -d / 2 + 0.14f}, {x + each - 0.01f, back + 0.04f, -d / 2 + 0.32f}, 0.07f, c);
        }
        if (throw_on) {  // a blanket over seat and front
          const int t = s.material(blanket);
          const float x = s.random().between(-0.2f, 0.2f) * width;
          s.cushion({x - 0.3f, seat - 0.002f, -d / 2 + 0.36f}, {x + 0.3f, seat + 0.018f, d / 2 + 0.025f}, 0.009f, t, 2);
          s.cushion({x - 0.3f, 0.16f, d / 2 + 0.01f}, {x + 0.3f, seat + 0.018f, d / 2 + 0.028f}, 0.009f, t, 2);
        }
        for (std::size_t i = 0; i < pillows.size(); ++i) {
          const float x = (i % 2 ? 1.f : -1.f) * (width / 2 - arm - 0.22f) * (i > 1 ? 0.3f : 1.f);
          glm::mat4 lean(1);
          lean[1] = glm::vec4(0, 0.92f, -0.39f, 0), lean[2] = glm::vec4(0, 0.39f, 0.92f, 0);
          lean[3] = glm::vec4(x, seat + 0.01f, -d / 2 + 0.42f, 1);
          s.at(lean).cushion({-0.2f, 0, -0.06f}, {0.2f, 0.38f, 0.06f}, 0.058f, s.material(pillows[i]));
        }
      }};
}

Piece bed(const Kit& kit, Random& random) {
  const float w = random.one_of({0.95f, 1.45f, 1.65f, 1.85f}), d = random.between(2.05f, 2.15f);
  const float head = random.between(0.8f, 1.15f), deck = random.between(0.28f, 0.36f);
  const Material frame = random.chance(0.7f) ? kit.palette->wood() : kit.palette->fabric();
  const Material sheet = kit.palette->make(MaterialClass::Fabric), cover = kit.palette->make(MaterialClass::Fabric);
  const Material pillow = kit.palette->make(MaterialClass::Fabric);
  const float folded = random.between(0.5f, 0.8f);
  return {"bed", {w, head, d}, [=](Shapes& s) {
            const int f = s.material(frame);
            s.box({-w / 2, 0.08f, -d / 2 + 0.05f}, {w / 2, deck, d / 2}, f);
            s.box({-w / 2, 0, -d / 2}, {w / 2, head, -d / 2 + 0.06f}, f);
            legs(s, w / 2 - 0.05f, d / 2 - 0.05f, 0.1f, 0.07f, f, false);
            s.cushion({-w / 2 + 0.02f, deck, -d / 2 + 0.07f}, {w / 2 - 0.02f, deck + 0.2f, d / 2 - 0.02f}, 0.06f,
                      s.material(sheet));
            s.cushion({-w / 2 - 0.03f, deck + 0.02f, d / 2 - d * folded}, {w / 2 + 0.03f, deck + 0.27f, d / 2 + 0.02f},
                      0.07f, s.material(cover));
            const int pillows = w > 1.2f ? 2 : 1, p = s.material(pillow);
            for (int i = 0; i < pillows; ++i) {
              const float x = pillows == 1 ? 0 : (i ? 1.f : -1.f) * w / 4;
              s.cushion({x - 0.32f, deck + 0.18f, -d / 2 + 0.1f}, {x + 0.32f, deck + 0.33f, -d / 2 + 0.5f}, 0.07f, p);
            }
          }};
}

}  // namespace clerestory
