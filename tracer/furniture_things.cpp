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

void candles(Shapes& s, const Kit& kit, float room) {
  Random& r = s.random();
  const int metal = s.material(kit.palette->metal()), wax = s.material(kit.palette->make(MaterialClass::Paper));
  for (int i = r.whole(1, 3); i > 0; --i) {
    const float h = std::min(room, r.between(0.12f, 0.3f)), x = r.between(-0.06f, 0.06f), z = r.between(-0.05f, 0.05f);
    s.lathe({x, 0, z}, {{0.035f, 0}, {0.03f, 0.008f}, {0.008f, 0.02f}, {0.008f, h * 0.45f}, {0.016f, h * 0.5f}}, metal,
            12);
    s.cylinder({x, h * 0.5f, z}, 0.011f, h * 0.5f, wax, 10);
  }
}

void jar(Shapes& s, int body, int lid, float height) {
  const float r = height * 0.36f;
  s.lathe({0, 0, 0}, {{r * 0.95f, 0}, {r, 0.01f}, {r, height * 0.8f}, {r * 0.8f, height * 0.86f}}, body, 16);
  s.cylinder({0, height * 0.86f, 0}, r * 0.85f, height * 0.14f, lid, 16);
}

void can(Shapes& s, int body, int rim) {
  s.cylinder({0, 0.004f, 0}, 0.033f, 0.112f, body, 16);
  s.lathe({0, 0, 0}, {{0.03f, 0}, {0.0332f, 0.006f}}, rim, 16);
  s.lathe({0, 0.114f, 0}, {{0.0332f, 0}, {0.029f, 0.008f}}, rim, 16);
}

void pen_pot(Shapes& s, const Kit& kit) {
  Random& r = s.random();
  s.lathe({0, 0, 0}, {{0.038f, 0}, {0.04f, 0.1f}, {0.036f, 0.1f}, {0.034f, 0.01f}, {0, 0.01f}},
          s.material(kit.palette->trinket()), 14, -1, true);
  for (int i = r.whole(2, 5); i > 0; --i) {
    const float a = r.between(0, 6.2832f), lean = r.between(0.01f, 0.03f);
    s.tube({{0.5f * lean * std::cos(a), 0.012f, 0.5f * lean * std::sin(a)},
            {lean * std::cos(a), r.between(0.13f, 0.17f), lean * std::sin(a)}},
           0.004f, s.material(kit.palette->make(MaterialClass::Plastic)), 6);
  }
}

void sheets(Shapes& s, const Kit& kit) {
  Random& r = s.random();
  for (int i = r.whole(1, 4), k = 0; k < i; ++k) {
    Shapes one = s.at({r.between(-0.04f, 0.04f), 0.0012f * static_cast<float>(k), r.between(-0.03f, 0.03f)},
                      r.between(-0.5f, 0.5f));
    const bool printed = r.chance(0.4f);
    one.block({0, 0, 0}, {0.21f, 0.001f, 0.297f},
              one.material(printed ? kit.palette->make(MaterialClass::Paper) : kit.palette->ceiling()));
  }
}

void keyboard(Shapes& s, int shell, int keys) {
  s.block({0, 0, 0}, {0.43f, 0.014f, 0.13f}, shell);
  for (int row = 0; row < 5; ++row) {
    const float z = -0.05f + 0.025f * static_cast<float>(row);
    s.block({0, 0.014f, z}, {0.4f, 0.006f, 0.019f}, keys);
  }
  s.cushion({0.28f, 0, -0.05f}, {0.34f, 0.035f, 0.05f}, 0.017f, shell, 2);
}

void kettle(Shapes& s, int metal, int grip) {
  s.lathe({0, 0, 0}, {{0.085f, 0}, {0.09f, 0.02f}, {0.075f, 0.15f}, {0.05f, 0.19f}, {0.012f, 0.2f}, {0.014f, 0.22f}},
          metal, 20);
  s.tube({{-0.05f, 0.18f, 0}, {-0.1f, 0.21f, 0}, {-0.13f, 0.15f, 0}, {-0.1f, 0.05f, 0}}, 0.012f, grip, 8);
  s.tube({{0.06f, 0.12f, 0}, {0.11f, 0.17f, 0}}, 0.014f, metal, 8);
}

void pan(Shapes& s, int metal, int grip) {
  Random& r = s.random();
  const float radius = r.between(0.09f, 0.14f), h = r.between(0.05f, 0.16f);
  s.lathe(
      {0, 0, 0},
      {{radius * 0.95f, 0}, {radius, 0.01f}, {radius, h}, {radius - 0.004f, h}, {radius - 0.006f, 0.008f}, {0, 0.008f}},
      metal, 24, -1, true);
  if (r.chance(0.5f))
    s.tube({{radius, h * 0.85f, 0}, {radius + 0.17f, h * 0.95f, 0}}, 0.009f, grip, 8);
  else
    for (const float x : {-1.f, 1.f})
      s.tube({{x * radius, h * 0.8f, -0.03f},
              {x * (radius + 0.03f), h * 0.8f, -0.03f},
              {x * (radius + 0.03f), h * 0.8f, 0.03f},
              {x * radius, h * 0.8f, 0.03f}},
             0.006f, metal, 6);
}

void clock(Shapes& s, const Kit& kit) {
  const int rim = s.material(kit.palette->metal()), face = s.material(kit.palette->ceiling());
  Shapes c =
      s.at(glm::mat4(glm::vec4(1, 0, 0, 0), glm::vec4(0, 0, 1, 0), glm::vec4(0, -1, 0, 0), glm::vec4(0, 0.08f, 0, 1)));
  c.lathe({0, -0.02f, 0}, {{0.075f, 0}, {0.078f, 0.03f}, {0.07f, 0.042f}, {0.068f, 0.036f}}, rim, 24);
  c.lathe({0, 0.0165f, 0}, {{0.069f, 0}, {0, 0.0005f}}, face, 24, -1, true);
}

void stationery(Shapes& s, const Kit& kit) {
  Random& r = s.random();
  switch (r.whole(0, 3)) {
    case 0:
      return pen_pot(s, kit);
    case 1:
      return sheets(s, kit);
    case 2:
      return keyboard(s, s.material(kit.palette->make(MaterialClass::Plastic)), s.material(kit.palette->glass()));
    default:
      return can(s, s.material(kit.palette->trinket()), s.material(kit.palette->metal()));
  }
}

void crockery(Shapes& s, const Kit& kit, float room) {
  Random& r = s.random();
  Palette& p = *kit.palette;
  switch (r.whole(0, 4)) {
    case 0:
      return jar(s, s.material(p.trinket()), s.material(p.metal()), std::min(room, r.between(0.1f, 0.2f)));
    case 1:
      if (room > 0.23f) return kettle(s, s.material(r.chance(0.6f) ? p.chrome() : p.enamel()), s.material(p.glass()));
      return plate(s, s.material(p.make(MaterialClass::Ceramic)), 0.1f);
    case 2:
      if (room > 0.17f) return pan(s, s.material(p.metal()), s.material(p.glass()));
      return plate(s, s.material(p.make(MaterialClass::Ceramic)), 0.12f);
    case 3: {  // plates on one another
      const int china = s.material(p.make(MaterialClass::Ceramic));
      for (int i = r.whole(2, 5); i >= 0; --i) {
        Shapes one = s.at({0, 0.012f * static_cast<float>(i), 0});
        plate(one, china, 0.12f);
      }
      return;
    }
    default:
      return mug(s, s.material(p.make(MaterialClass::Ceramic)));
  }
}

/// A bowl with fruit in it.
void fruit_bowl(Shapes& s, const Kit& kit) {
  Palette& p = *kit.palette;
  const int bowl = s.material(p.trinket());
  s.lathe({0, 0, 0}, {{0.05f, 0}, {0.1f, 0.03f}, {0.125f, 0.07f}}, bowl, 20, -1, true);
  s.lathe({0, 0, 0}, {{0.12f, 0.07f}, {0.095f, 0.034f}, {0, 0.01f}}, bowl, 20, -1, true);
  const int f = s.material(p.make(MaterialClass::Plastic));
  for (int i = 0; i < 4; ++i) {
    const float a = 1.5708f * static_cast<float>(i) + 0.3f;
    s.sphere({0.045f * std::cos(a), 0.058f, 0.045f * std::sin(a)}, 0.034f, f, 8);
  }
}

void model_thing(Shapes& s, const Kit& kit, float room) {
  Random& r = s.random();
  const Model& model = r.one_of(*kit.models);
  const MaterialClass kinds[] = {MaterialClass::Ceramic, MaterialClass::Metal, MaterialClass::Plastic,
                                 MaterialClass::Stone};
  s.mesh(model, {0, 0, 0}, std::min(room, r.between(0.14f, 0.3f)), s.material(kit.palette->make(kinds[r.whole(0, 3)])));
}

/// One thing of at most the given height.
void thing(Shapes& s, const Kit& kit, float room) {
  Random& r = s.random();
  Palette& p = *kit.palette;
  if (p.is_varied() && r.chance(0.5f)) {
    const float kind = r.unit();
    if (kind < (p.is_wild() ? 0.6f : 0.25f)) return random_solid(s, kit, 0.2f, room);
    if (kind < 0.92f || room < 0.15f) return package(s, kit, room);
    return s.cloth({0, 0.001f, 0}, {0.28f, r.between(0.02f, 0.08f), 0.26f}, s.material(p.print()), 14);
  }
  const bool has_models = kit.models && !kit.models->empty();
  switch (r.whole(0, has_models ? 15 : 14)) {
    case 0:
      return mug(s, s.material(p.make(MaterialClass::Ceramic)));
    case 1:
      return vase(s, s.material(r.chance(0.7f) ? p.make(MaterialClass::Ceramic) : p.trinket()),
                  std::min(room, r.between(0.15f, 0.38f)));
    case 2:
    case 3:
      return book_pile(s, kit, room);
    case 4:
      if (room > 0.3f)
        return bottle(s, s.material(r.chance(0.5f) ? p.make(MaterialClass::Plastic) : p.make(MaterialClass::Ceramic)));
      return mug(s, s.material(p.make(MaterialClass::Ceramic)));
    case 5:
    case 6:
      return crockery(s, kit, room);
    case 7: {
      const float radius = std::min(r.between(0.03f, 0.07f), room / 2.1f);
      return s.sphere({0, radius, 0}, radius, s.material(p.trinket()), 12);
    }
    case 8: {
      const float h = std::min(room, r.between(0.05f, 0.22f));
      return s.block({0, 0, 0}, {r.between(0.06f, 0.2f), h, r.between(0.05f, 0.15f)}, s.material(p.trinket()));
    }
    case 9:
      if (room > 0.25f) return laptop(s, s.material(p.metal()), s.material(p.glass()));
      return book_pile(s, kit, room);
    case 10:
      return frame_on_stand(s, kit);
    case 11:
      return fruit_bowl(s, kit);
    case 12:
      if (room > 0.2f) return r.chance(0.5f) ? candles(s, kit, room) : clock(s, kit);
      return can(s, s.material(p.trinket()), s.material(p.metal()));
    case 13:
      if (room > 0.3f) return potted_plant(s, kit, r.between(0.045f, 0.07f), std::min(room, r.between(0.2f, 0.4f)));
      return jar(s, s.material(p.trinket()), s.material(p.metal()), std::min(room, 0.12f));
    case 14:
      return stationery(s, kit);
    default:
      return model_thing(s, kit, room);
  }
}

}  // namespace

void books(Shapes& shapes, const Kit& kit, float width, float height, float depth) {
  Random& r = shapes.random();
  std::vector<int> covers;
  for (int i = 0; i < 8; ++i) covers.push_back(shapes.material(kit.palette->make(MaterialClass::Paper)));
  for (float x = 0; x < width - 0.05f;) {
    const float thick = r.between(0.015f, 0.05f), h = height * r.between(0.72f, 1.f), d = depth * r.between(0.75f, 1.f);
    shapes.box({x, 0, depth / 2 - d}, {x + thick - 0.001f, h, depth / 2}, r.one_of(covers));
    x += thick;
    if (r.chance(0.07f) && x < width - 0.2f) {  // one leans against it
      const float lean = r.between(0.12f, 0.3f), c = std::cos(lean), n = std::sin(lean), tall = 0.8f * height;
      Shapes leaning = shapes.at(glm::mat4(glm::vec4(c, n, 0, 0), glm::vec4(-n, c, 0, 0), glm::vec4(0, 0, 1, 0),
                                           glm::vec4(x + tall * n + 0.002f, 0, 0, 1)));
      leaning.box({0, 0, depth / 2 - d}, {0.02f, tall, depth / 2}, r.one_of(covers));
      x += tall * n + 0.03f;
    }
    if (r.chance(0.06f)) x += r.between(0.02f, 0.1f);
  }
}

void clutter(Shapes& shapes, const Kit& kit, float width, float depth, float head_room, int count) {
  if (head_room < 0.06f || count < 1) return;
  // One thing per cell of a row or grid; cells are wide enough for the widest thing, and a few stay empty.
  const int columns = std::max(1, static_cast<int>(width / 0.3f)), rows = std::max(1, static_cast<int>(depth / 0.28f));
  std::vector<int> cells(static_cast<std::size_t>(columns) * rows);
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = static_cast<int>(i);
  Random& r = shapes.random();
  r.shuffle(cells);
  if (kit.palette->is_varied() && r.chance(0.5f)) count += r.whole(1, 4);
  for (int i = 0; i < std::min(count, static_cast<int>(cells.size())); ++i) {
    const int column = cells[static_cast<std::size_t>(i)] % columns, row = cells[static_cast<std::size_t>(i)] / columns;
    const float x = width * ((static_cast<float>(column) + 0.5f) / static_cast<float>(columns) - 0.5f);
    const float z = depth * ((static_cast<float>(row) + 0.5f) / static_cast<float>(rows) - 0.5f);
    Shapes one = shapes.at({x + r.between(-0.03f, 0.03f), 0, z + r.between(-0.02f, 0.02f)}, r.between(-0.6f, 0.6f));
    thing(one, kit, head_room);
  }
}

void potted_plant(Shapes& s, const Kit& kit, float pot, float height) {
  Random& r = s.random();
  s.lathe({0, 0, 0},
          {{pot * 0.75f, 0}, {pot, 1.7f * pot}, {pot * 0.9f, 1.7f * pot}, {pot * 0.88f, 1.5f * pot}, {0, 1.5f * pot}},
          s.material(kit.palette->trinket()), 20, -1, true);
  const int green = s.material(kit.palette->leaf());
  const float soil = 1.5f * pot, h = height, broad = r.chance(0.4f) ? 2.2f : 1.f, bend = r.between(0.6f, 1.6f);
  for (int i = r.whole(14, 30); i > 0; --i) {  // each leaf: a bent blade of four quads, seen from both sides
    const float a = r.between(0, 6.2832f), reach = h * r.between(0.12f, 0.3f),
                top = soil + (h - soil) * r.between(0.4f, 1.f);
    const float wide = std::min(broad * r.between(0.02f, 0.05f), 0.12f * h);
    const glm::vec3 out(std::cos(a), 0, std::sin(a)), side(-std::sin(a), 0, std::cos(a));
    const auto at = [&](int k) {
      const float t = static_cast<float>(k) / 4;
      return out * (0.02f + reach * std::pow(t, 1 + bend)) +
             glm::vec3(0, soil + (top - soil) * t * (1.25f - 0.25f * t * t), 0);
    };
    const auto half = [&](int k) { return side * (wide * std::sin(0.35f + 2.7f * static_cast<float>(k) / 4)); };
    for (int k = 0; k < 4; ++k)
      s.quad(at(k) - half(k), at(k) + half(k), at(k + 1) + half(k + 1), at(k + 1) - half(k + 1), green);
  }
}

Piece plant(const Kit& kit, Random& random) {
  const float h = random.between(0.5f, 1.7f), pot = random.between(0.12f, 0.2f);
  return {"plant", {std::max(2 * pot, 0.66f * h), h, std::max(2 * pot, 0.66f * h)}, [=](Shapes& s) {
            potted_plant(s, kit, pot, h);
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
