// What lies and stands about on floors.
#include <algorithm>
#include <cmath>

#include "tracer/furniture.hpp"

namespace clerestory {

Piece basket(const Kit& kit, Random& random) {
  const float r = random.between(0.12f, 0.24f), h = r * random.between(1.1f, 2.f);
  const Material body = random.chance(0.4f)   ? kit.palette->wood()
                        : random.chance(0.5f) ? kit.palette->fabric()
                                              : kit.palette->make(MaterialClass::Plastic);
  const Material inside = kit.palette->make(MaterialClass::Fabric);
  const bool full = random.chance(0.6f);
  return {
      "basket", {2 * r, h, 2 * r}, [=](Shapes& s) {
        const int b = s.material(body);
        s.lathe({0, 0, 0}, {{r * 0.8f, 0}, {r, h}, {r * 0.95f, h}, {r * 0.76f, 0.02f}, {0, 0.02f}}, b, 22, -1, true);
        if (full)
          s.cushion({-r * 0.6f, h * 0.5f, -r * 0.6f}, {r * 0.6f, h * 0.98f, r * 0.6f}, r * 0.3f, s.material(inside), 3);
      }};
}

Piece bag(const Kit& kit, Random& random) {
  const float w = random.between(0.28f, 0.5f), h = random.between(0.22f, 0.42f), d = random.between(0.12f, 0.22f);
  const Material cloth =
      random.chance(0.5f) ? kit.palette->make(MaterialClass::Leather) : kit.palette->make(MaterialClass::Fabric);
  const float turn = random.between(-0.5f, 0.5f);
  return {"bag", {w + 0.08f, h + 0.12f, d + 0.2f}, [=](Shapes& whole) {
            Shapes s = whole.at({0, 0, 0}, turn * 0.4f);
            const int m = s.material(cloth);
            s.cushion({-w / 2, 0, -d / 2}, {w / 2, h, d / 2}, d * 0.45f, m, 3);
            for (const float z : {-0.3f, 0.3f})
              s.tube({{-w * 0.25f, h * 0.9f, z * d},
                      {-w * 0.15f, h + 0.1f, z * d},
                      {w * 0.15f, h + 0.1f, z * d},
                      {w * 0.25f, h * 0.9f, z * d}},
                     0.011f, m, 6);
          }};
}

Piece shoes(const Kit& kit, Random& random) {
  const Material upper =
      random.chance(0.5f) ? kit.palette->make(MaterialClass::Leather) : kit.palette->make(MaterialClass::Fabric);
  const Material sole = kit.palette->make(MaterialClass::Plastic);
  const float apart = random.between(0.06f, 0.09f), turn = random.between(-0.4f, 0.4f);
  return {"shoes", {0.32f, 0.13f, 0.36f}, [=](Shapes& whole) {
            for (const float side : {-1.f, 1.f}) {
              Shapes s = whole.at({side * apart, 0, side * 0.02f}, side > 0 ? turn * 0.5f : 0);
              const int u = s.material(upper), b = s.material(sole);
              s.cushion({-0.045f, 0, -0.14f}, {0.045f, 0.025f, 0.14f}, 0.011f, b, 1);
              s.cushion({-0.043f, 0.015f, -0.135f}, {0.043f, 0.075f, 0.135f}, 0.035f, u, 2);
              s.cushion({-0.041f, 0.03f, -0.135f}, {0.041f, 0.125f, -0.02f}, 0.034f, u, 2);
            }
          }};
}

Piece toys(const Kit& kit, Random& random) {
  const int count = random.whole(4, 11);
  return {"toys", {0.7f, 0.16f, 0.7f}, [=](Shapes& s) {
            Random& r = s.random();
            std::vector<int> colors;
            for (int i = 0; i < 4; ++i)
              colors.push_back(
                  s.material(kit.palette->make(r.chance(0.6f) ? MaterialClass::Plastic : MaterialClass::GlossPaint)));
            for (int i = 0; i < count; ++i) {  // one a cell, so that none is in another
              const float x = -0.24f + 0.16f * static_cast<float>(i % 4), z = -0.24f + 0.2f * static_cast<float>(i / 4);
              Shapes one = s.at({x, 0, z}, r.between(0, 1.5f));
              const float size = r.between(0.03f, 0.09f);
              const int m = r.one_of(colors);
              switch (r.whole(0, 3)) {
                case 0:
                  one.sphere({0, size / 2, 0}, size / 2, m, 8);
                  break;
                case 1:
                  one.cylinder({0, 0, 0}, size / 2, size, m, 12);
                  break;
                case 2:
                  one.lathe({0, 0, 0}, {{size / 2, 0}, {0, size}}, m, 12);
                  break;
                default:
                  one.block({0, 0, 0}, {size, size * 0.8f, size}, m);
                  break;
              }
            }
          }};
}

Piece papers(const Kit& kit, Random& random) {
  const int count = random.whole(2, 9);
  return {"papers", {0.42f, 0.05f + 0.03f * static_cast<float>(count), 0.42f}, [=](Shapes& s) {
            Random& r = s.random();
            float y = 0;
            for (int i = 0; i < count; ++i) {
              const glm::vec3 size(r.between(0.16f, 0.3f), r.between(0.004f, 0.035f), r.between(0.2f, 0.3f));
              s.at({r.between(-0.03f, 0.03f), y, r.between(-0.03f, 0.03f)}, r.between(-0.3f, 0.3f))
                  .block({0, 0, 0}, size, s.material(kit.palette->make(MaterialClass::Paper)));
              y += size.y;
            }
          }};
}

Piece floor_cushion(const Kit& kit, Random& random) {
  const float w = random.between(0.4f, 0.65f), h = random.between(0.1f, 0.18f), d = w * random.between(0.9f, 1.2f);
  const Material cloth = random.chance(0.5f) ? kit.palette->print() : kit.palette->fabric();
  return {"floor_cushion", {w, h, d}, [=](Shapes& s) {
            s.cushion({-w / 2, 0, -d / 2}, {w / 2, h, d / 2}, h * 0.48f, s.material(cloth));
          }};
}

Piece speaker(const Kit& kit, Random& random) {
  const float w = random.between(0.16f, 0.26f), h = random.between(0.5f, 1.1f), d = random.between(0.2f, 0.32f);
  const Material body = random.chance(0.5f) ? kit.palette->wood() : kit.palette->make(MaterialClass::Plastic);
  const Material cone = kit.palette->glass(), rim = kit.palette->metal();
  return {
      "speaker", {w, h, d}, [=](Shapes& s) {
        s.box({-w / 2, 0, -d / 2}, {w / 2, h, d / 2 - 0.02f}, s.material(body));
        for (const float y : {0.35f, 0.68f, 0.88f}) {
          const float r = w * (y < 0.8f ? 0.38f : 0.2f);
          Shapes c = s.at(glm::mat4(glm::vec4(1, 0, 0, 0), glm::vec4(0, 0, 1, 0), glm::vec4(0, -1, 0, 0),
                                    glm::vec4(0, h * y, d / 2 - 0.02f, 1)));
          c.lathe({0, 0, 0}, {{r, 0}, {r, 0.008f}, {r * 0.9f, 0.008f}}, s.material(rim), 20, -1, true);
          c.lathe({0, 0.001f, 0}, {{r * 0.92f, 0.006f}, {r * 0.3f, 0}, {0, 0.005f}}, s.material(cone), 20, -1, true);
        }
      }};
}

Piece leaning_picture(const Kit& kit, Random& random) {
  const float w = random.between(0.4f, 0.9f), h = random.between(0.6f, 1.6f), lean = 0.12f;
  const bool mirror = h > 1.2f && random.chance(0.7f);
  const Material frame = random.chance(0.5f) ? kit.palette->wood() : kit.palette->metal();
  const Material face = mirror ? kit.palette->mirror() : kit.palette->painting();
  return {mirror ? "mirror" : "picture", {w, h, h * lean + 0.06f}, [=](Shapes& whole) {
            const float c = std::cos(lean), n = std::sin(lean);
            Shapes s = whole.at(glm::mat4(glm::vec4(1, 0, 0, 0), glm::vec4(0, c, -n, 0), glm::vec4(0, n, c, 0),
                                          glm::vec4(0, 0.003f, h * lean / 2, 1)));
            s.box({-w / 2, 0, -0.02f}, {w / 2, h, 0}, s.material(frame));
            const float b = 0.03f;
            s.canvas({-w / 2 + b, b, 0.0015f}, {w / 2 - b, b, 0.0015f}, {w / 2 - b, h - b, 0.0015f},
                     {-w / 2 + b, h - b, 0.0015f}, s.material(face));
          }};
}

namespace {

/// What training rooms have beside.
Piece further_clutter(const Kit& kit, Random& random) {
  const float kind = random.unit(), solid = kit.palette->is_wild() ? 0.55f : 0.2f;
  if (kind < solid) return solids(kit, random);
  switch (random.whole(0, 4)) {
    case 0:
    case 1:
      return cartons(kit, random);
    case 2:
      return garment(kit, random);
    case 3:
      return cable(kit, random);
    default:
      return packages(kit, random);
  }
}

}  // namespace

Piece floor_clutter(const Kit& kit, Random& random) {
  if (kit.palette->is_varied() && random.chance(0.6f)) return further_clutter(kit, random);
  switch (random.whole(0, 8)) {
    case 0:
      return basket(kit, random);
    case 1:
      return bag(kit, random);
    case 2:
      return shoes(kit, random);
    case 3:
      return toys(kit, random);
    case 4:
      return papers(kit, random);
    case 5:
      return floor_cushion(kit, random);
    case 6:
      return speaker(kit, random);
    case 7:
      return ball(kit, random);
    default:
      return box_stack(kit, random);
  }
}

}  // namespace clerestory
