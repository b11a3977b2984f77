// Small things: books, vases, lamps, plants, balls, models.
#include <algorithm>
#include <cmath>

#include "tracer/furniture.hpp"

namespace clerestory {
namespace {

void mug(Shapes& s, int material) {
  s.lathe({0, 0, 0}, {{0.032f, 0}, {0.04f, 0.01f}, {0.04f, 0.095f}}, material, 16, -1, true);
  s.lathe({0, 0, 0}, {{0.036f, 0.095f}, {0.036f, 0.012f}, {0, 0.012f}}, material, 16, -1, true);
  for (int i = 0; i < 5; ++i) {
    const auto at = [](int k) {
      const float a = -1.2f + 0.48f * static_cast<float>(k);
      return glm::vec3(0.038f + 0.028f * std::cos(a), 0.05f + 0.03f * std::sin(a), 0);
    };
    s.rod(at(i), at(i + 1), 0.009f, material);
  }
}

void vase(Shapes& s, int material, float height) {
  Random& r = s.random();
  std::vector<glm::vec2> profile;
  const float foot = r.between(0.03f, 0.05f), belly = r.between(0.05f, 0.1f), neck = r.between(0.015f, 0.04f);
  const float place = r.between(0.3f, 0.6f);
  for (int i = 0; i <= 12; ++i) {
    const float t = static_cast<float>(i) / 12;
    const float bulge = std::exp(-12 * (t - place) * (t - place));
    profile.push_back({foot * (1 - t) + neck * t + (belly - foot) * bulge, t * height});
  }
  s.lathe({0, 0, 0}, profile, material, 20);
}

void bottle(Shapes& s, int material) {
  s.lathe({0, 0, 0}, {{0.034f, 0}, {0.037f, 0.01f}, {0.037f, 0.17f}, {0.014f, 0.23f}, {0.014f, 0.29f}}, material, 16);
}

void plate(Shapes& s, int material, float radius) {
  s.lathe({0, 0, 0},
          {{radius * 0.6f, 0}, {radius, 0.018f}, {radius - 0.004f, 0.02f}, {radius * 0.62f, 0.006f}, {0, 0.006f}},
          material, 24, -1, true);
}

void book_pile(Shapes& s, const Kit& kit, float room) {
  Random& r = s.random();
  float y = 0;
  for (int i = r.whole(1, 4); i > 0 && y < room - 0.05f; --i) {
    const glm::vec3 size(r.between(0.13f, 0.24f), r.between(0.015f, 0.045f), r.between(0.1f, 0.17f));
    Shapes book = s.at({0, y, 0}, r.between(-0.4f, 0.4f));
    const int cover = book.material(kit.palette->make(MaterialClass::Paper));
    const int paper = book.material(kit.palette->ceiling());
    book.block({0, 0, 0}, {size.x, 0.003f, size.z}, cover);
    book.block({0.003f, 0.003f, 0}, {size.x - 0.012f, size.y - 0.006f, size.z - 0.01f}, paper);
    book.block({0, size.y - 0.003f, 0}, {size.x, 0.003f, size.z}, cover);
    book.box({-size.x / 2, 0, -size.z / 2}, {-size.x / 2 + 0.004f, size.y, size.z / 2}, cover);
    y += size.y;
  }
}

void laptop(Shapes& s, int shell, int screen) {
  s.block({0, 0, 0}, {0.34f, 0.016f, 0.23f}, shell);
  s.box({-0.14f, 0.016f, -0.09f}, {0.14f, 0.018f, 0.02f}, screen);
  Shapes lid = s.at(glm::mat4(glm::vec4(1, 0, 0, 0), glm::vec4(0, 0.94f, -0.34f, 0), glm::vec4(0, 0.34f, 0.94f, 0),
                              glm::vec4(0, 0.014f, -0.11f, 1)));
  lid.box({-0.17f, 0, -0.008f}, {0.17f, 0.22f, 0}, shell);
  lid.box({-0.16f, 0.01f, 0}, {0.16f, 0.21f, 0.001f}, screen);
}

void frame_on_stand(Shapes& s, const Kit& kit) {
  Random& r = s.random();
  const float w = r.between(0.1f, 0.18f), h = r.between(0.12f, 0.22f);
  Shapes f = s.at(glm::mat4(glm::vec4(1, 0, 0, 0), glm::vec4(0, 0.97f, -0.24f, 0), glm::vec4(0, 0.24f, 0.97f, 0),
                            glm::vec4(0, 0, 0.02f, 1)));
  f.box({-w / 2, 0, -0.012f}, {w / 2, h, 0}, s.material(kit.palette->metal()));
  f.canvas({-w / 2 + 0.012f, 0.012f, 0.001f}, {w / 2 - 0.012f, 0.012f, 0.001f}, {w / 2 - 0.012f, h - 0.012f, 0.001f},
           {-w / 2 + 0.012f, h - 0.012f, 0.001f}, s.material(kit.palette->painting()));
}

/// One thing of at most the given height.
void thing(Shapes& s, const Kit& kit, float room) {
  Random& r = s.random();
  Palette& p = *kit.palette;
  const bool has_models = kit.models && !kit.models->empty();
  switch (r.whole(0, has_models ? 10 : 9)) {
    case 0:
      return mug(s, s.material(p.make(MaterialClass::Ceramic)));
    case 1:
      return vase(s, s.material(r.chance(0.7f) ? p.make(MaterialClass::Ceramic) : p.trinket()),
                  std::min(room, r.between(0.15f, 0.38f)));
    case 2:
      return book_pile(s, kit, room);
    case 3:
      if (room > 0.3f)
        return bottle(s, s.material(r.chance(0.5f) ? p.make(MaterialClass::Plastic) : p.make(MaterialClass::Ceramic)));
      return mug(s, s.material(p.make(MaterialClass::Ceramic)));
    case 4:
      return plate(s, s.material(p.make(MaterialClass::Ceramic)), r.between(0.09f, 0.14f));
    case 5: {
      const float radius = std::min(r.between(0.03f, 0.09f), room / 2.1f);
      return s.sphere({0, radius, 0}, radius, s.material(p.trinket()), 12);
    }
    case 6: {
      const float h = std::min(room, r.between(0.05f, 0.22f));
      return s.block({0, 0, 0}, {r.between(0.06f, 0.2f), h, r.between(0.05f, 0.15f)}, s.material(p.trinket()));
    }
    case 7:
      if (room > 0.25f) return laptop(s, s.material(p.metal()), s.material(p.glass()));
      return book_pile(s, kit, room);
    case 8:
      return frame_on_stand(s, kit);
    case 9: {  // a bowl of fruit
      const int bowl = s.material(p.trinket());
      s.lathe({0, 0, 0}, {{0.05f, 0}, {0.1f, 0.03f}, {0.125f, 0.07f}}, bowl, 20, -1, true);
      s.lathe({0, 0, 0}, {{0.12f, 0.07f}, {0.095f, 0.034f}, {0, 0.01f}}, bowl, 20, -1, true);
      Material fruit = p.make(MaterialClass::Plastic);
      const int f = s.material(fruit);
      for (int i = 0; i < 4; ++i) {
        const float a = 1.5708f * static_cast<float>(i) + 0.3f;
        s.sphere({0.045f * std::cos(a), 0.058f, 0.045f * std::sin(a)}, 0.034f, f, 8);
      }
      return;
    }
    default: {
      const Model& model = r.one_of(*kit.models);
      const MaterialClass kinds[] = {MaterialClass::Ceramic, MaterialClass::Metal, MaterialClass::Plastic,
                                     MaterialClass::Stone};
      return s.mesh(model, {0, 0, 0}, std::min(room, r.between(0.14f, 0.3f)), s.material(p.make(kinds[r.whole(0, 3)])));
    }
  }
}

}  // namespace

glm::vec3 lamp_color(Random& random) {
  const glm::vec3 warm(1.5f, 0.93f, 0.45f), cold(0.9f, 1.0f, 1.2f);
  const float t = random.unit();
  const glm::vec3 c = warm + (cold - warm) * t;
  return c / (0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z);
}

void books(Shapes& shapes, const Kit& kit, float width, float height, float depth) {
  Random& r = shapes.random();
  std::vector<int> covers;
  for (int i = 0; i < 5; ++i) covers.push_back(shapes.material(kit.palette->make(MaterialClass::Paper)));
  for (float x = 0; x < width - 0.05f;) {
    const float thick = r.between(0.015f, 0.05f), h = height * r.between(0.72f, 1.f), d = depth * r.between(0.75f, 1.f);
    shapes.box({x, 0, depth / 2 - d}, {x + thick - 0.001f, h, depth / 2}, r.one_of(covers));
    x += thick;
    if (r.chance(0.06f)) x += r.between(0.02f, 0.1f);
  }
}

void table_lamp(Shapes& s, const Kit& kit, float height) {
  Random& r = s.random();
  const bool lit = r.chance(kit.lamp_on);
  const int foot = s.material(kit.palette->trinket()), shade = s.material(kit.palette->diffuser());
  const int light = lit ? s.emitter({lamp_color(r) * r.between(3.f, 9.f) * kit.lamp_power, false}) : -1;
  if (r.chance(0.3f)) {
    const float radius = height * 0.3f;
    s.lathe({0, 0, 0}, {{radius * 0.8f, 0}, {radius * 0.7f, 0.02f}, {0.012f, 0.03f}, {0.012f, height - 2 * radius}},
            foot, 16);
    s.sphere({0, height - radius, 0}, radius, shade, 8, light);
    return;
  }
  s.lathe({0, 0, 0}, {{0.06f, 0}, {0.065f, 0.01f}, {0.03f, 0.04f}, {0.045f, 0.12f}, {0.015f, height * 0.55f}}, foot,
          16);
  const float wide = r.between(0.1f, 0.15f), narrow = wide * r.between(0.55f, 1.f), low = height * 0.55f;
  s.lathe({0, 0, 0}, {{wide, low}, {narrow, height}}, shade, 20, light, true);
}

void clutter(Shapes& shapes, const Kit& kit, float width, float depth, float head_room, int count) {
  if (head_room < 0.06f || count < 1) return;
  // One thing per cell of a row or grid; cells are wide enough for the widest thing, and a few stay empty.
  const int columns = std::max(1, static_cast<int>(width / 0.3f)), rows = std::max(1, static_cast<int>(depth / 0.28f));
  std::vector<int> cells(static_cast<std::size_t>(columns) * rows);
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = static_cast<int>(i);
  Random& r = shapes.random();
  r.shuffle(cells);
  for (int i = 0; i < std::min(count, static_cast<int>(cells.size())); ++i) {
    const int column = cells[static_cast<std::size_t>(i)] % columns, row = cells[static_cast<std::size_t>(i)] / columns;
    const float x = width * ((static_cast<float>(column) + 0.5f) / static_cast<float>(columns) - 0.5f);
    const float z = depth * ((static_cast<float>(row) + 0.5f) / static_cast<float>(rows) - 0.5f);
    Shapes one = shapes.at({x + r.between(-0.03f, 0.03f), 0, z + r.between(-0.02f, 0.02f)}, r.between(-0.6f, 0.6f));
    thing(one, kit, head_room);
  }
}

Piece plant(const Kit& kit, Random& random) {
  const float h = random.between(0.5f, 1.5f), pot = random.between(0.12f, 0.2f);
  Material leaf = kit.palette->make(MaterialClass::Plastic);
  leaf.color_a = {0.05f, random.between(0.12f, 0.25f), 0.04f};
  leaf.color_b = leaf.color_a * 0.7f, leaf.color_c = leaf.color_a;
  leaf.roughness_a = random.between(0.35f, 0.5f), leaf.roughness_b = leaf.roughness_a + 0.1f;
  const Material vessel = kit.palette->trinket();
  return {
      "plant", {std::max(2 * pot, 0.6f * h), h, std::max(2 * pot, 0.6f * h)}, [=](Shapes& s) {
        Random& r = s.random();
        s.lathe(
            {0, 0, 0},
            {{pot * 0.75f, 0}, {pot, 1.7f * pot}, {pot * 0.9f, 1.7f * pot}, {pot * 0.88f, 1.5f * pot}, {0, 1.5f * pot}},
            s.material(vessel), 20, -1, true);
        const int green = s.material(leaf);
        const float soil = 1.5f * pot;
        for (int i = r.whole(14, 30); i > 0; --i) {  // each leaf: a bent blade of four quads, seen from both sides
          const float a = r.between(0, 6.2832f), reach = h * r.between(0.12f, 0.32f),
                      top = soil + (h - soil) * r.between(0.4f, 1.f);
          const float wide = r.between(0.02f, 0.05f);
          const glm::vec3 out(std::cos(a), 0, std::sin(a)), side(-std::sin(a), 0, std::cos(a));
          const auto at = [&](int k) {
            const float t = static_cast<float>(k) / 4;
            return out * (0.02f + reach * t * t) +
                   glm::vec3(0, soil + (top - soil) * t * (1.25f - 0.25f * t * t) / 1.0f, 0);
          };
          const auto half = [&](int k) { return side * (wide * std::sin(0.35f + 2.7f * static_cast<float>(k) / 4)); };
          for (int k = 0; k < 4; ++k)
            s.quad(at(k) - half(k), at(k) + half(k), at(k + 1) + half(k + 1), at(k + 1) - half(k + 1), green);
        }
      }};
}

Piece floor_lamp(const Kit& kit, Random& random) {
  const float h = random.between(1.3f, 1.75f), r = random.between(0.14f, 0.2f);
  const Material metal = kit.palette->metal(), shade = kit.palette->diffuser();
  const bool lit = random.chance(kit.lamp_on + 0.15f);
  const glm::vec3 radiance = lamp_color(random) * random.between(4.f, 10.f) * kit.lamp_power;
  return {"floor_lamp", {2 * r, h, 2 * r}, [=](Shapes& s) {
            const int m = s.material(metal);
            s.lathe({0, 0, 0}, {{r * 0.8f, 0}, {r * 0.8f, 0.02f}, {0.012f, 0.03f}, {0.012f, h - 0.22f}}, m, 20);
            s.lathe({0, h - 0.28f, 0}, {{r, 0}, {r * 0.8f, 0.28f}}, s.material(shade), 24,
                    lit ? s.emitter({radiance, false}) : -1, true);
          }};
}

Piece ball(const Kit& kit, Random& random) {
  const float r = random.between(0.09f, 0.32f);
  const Material m = random.chance(0.3f) ? kit.palette->metal() : kit.palette->trinket();
  return {"ball", {2 * r, 2 * r, 2 * r}, [=](Shapes& s) { s.sphere({0, r, 0}, r, s.material(m), 20); }};
}

Piece pedestal(const Kit& kit, Random& random, const Model& model) {
  const float h = random.between(0.4f, 0.9f), w = random.between(0.3f, 0.42f), tall = random.between(0.35f, 0.6f);
  const Material block = kit.palette->body();
  const MaterialClass kinds[] = {MaterialClass::Ceramic, MaterialClass::Metal, MaterialClass::Plastic,
                                 MaterialClass::Stone};
  const Material body = kit.palette->make(kinds[random.whole(0, 3)]);
  const Model* which = &model;
  return {"pedestal", {w, h + tall, w}, [=](Shapes& s) {
            s.block({0, 0, 0}, {w, h, w}, s.material(block));
            s.at({0, h, 0}, s.random().between(-0.6f, 0.6f)).mesh(*which, {0, 0, 0}, tall, s.material(body));
          }};
}

}  // namespace clerestory
