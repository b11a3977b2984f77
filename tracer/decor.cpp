// What hangs on walls and fills niches.
#include <algorithm>
#include <cmath>

#include "tracer/openings.hpp"

namespace clerestory {
namespace {

void frame_around(Shapes& s, float w, float h, float bar, float out, int material) {
  s.box({-w / 2, -h / 2, 0}, {w / 2, -h / 2 + bar, out}, material);
  s.box({-w / 2, h / 2 - bar, 0}, {w / 2, h / 2, out}, material);
  s.box({-w / 2, -h / 2 + bar, 0}, {-w / 2 + bar, h / 2 - bar, out}, material);
  s.box({w / 2 - bar, -h / 2 + bar, 0}, {w / 2, h / 2 - bar, out}, material);
}

void picture(Shapes& s, float w, float h, Palette& palette, bool mirror) {
  Random& r = s.random();
  const float bar = r.between(0.008f, 0.05f), out = r.between(0.015f, 0.03f);
  frame_around(s, w, h, bar, out,
               s.material(r.chance(0.4f)   ? palette.wood()
                          : r.chance(0.5f) ? palette.metal()
                                           : palette.make(MaterialClass::GlossPaint)));
  const float z = out * 0.5f, mat = !mirror && r.chance(0.5f) ? bar + std::min(w, h) * 0.14f : bar;
  if (mat > bar)
    s.quad({-w / 2 + bar, -h / 2 + bar, z - 0.002f}, {w / 2 - bar, -h / 2 + bar, z - 0.002f},
           {w / 2 - bar, h / 2 - bar, z - 0.002f}, {-w / 2 + bar, h / 2 - bar, z - 0.002f},
           s.material(palette.ceiling()));
  s.canvas({-w / 2 + mat, -h / 2 + mat, z}, {w / 2 - mat, -h / 2 + mat, z}, {w / 2 - mat, h / 2 - mat, z},
           {-w / 2 + mat, h / 2 - mat, z}, s.material(mirror ? palette.mirror() : palette.painting()));
}

/// Paper without a frame.
void poster(Shapes& s, float w, float h, Palette& palette) {
  s.canvas({-w / 2, -h / 2, 0.002f}, {w / 2, -h / 2, 0.002f}, {w / 2, h / 2, 0.002f}, {-w / 2, h / 2, 0.002f},
           s.material(palette.painting()));
}

/// A round body that faces the room: profile of radius and distance from the wall.
Shapes facing(Shapes& s) {
  return s.at(glm::mat4(glm::vec4(1, 0, 0, 0), glm::vec4(0, 0, 1, 0), glm::vec4(0, -1, 0, 0), glm::vec4(0, 0, 0, 1)));
}

void round_mirror(Shapes& s, float radius, Palette& palette) {
  const int frame = s.material(s.random().chance(0.5f) ? palette.metal() : palette.wood());
  Shapes c = facing(s);
  c.lathe({0, 0, 0}, {{radius + 0.02f, 0}, {radius + 0.02f, 0.025f}, {radius, 0.025f}, {radius, 0.01f}}, frame, 32, -1,
          true);
  c.lathe({0, 0.012f, 0}, {{radius, 0}, {0, 0.0001f}}, s.material(palette.mirror()), 32, -1, true);
}

void wall_clock(Shapes& s, float radius, Palette& palette) {
  const int rim = s.material(palette.metal()), face = s.material(palette.ceiling()), hand = s.material(palette.glass());
  Random& r = s.random();
  const float a = r.between(0, 6.28f), b = r.between(0, 6.28f);
  Shapes c = facing(s);
  c.lathe({0, 0, 0}, {{radius, 0}, {radius, 0.04f}, {radius * 0.92f, 0.04f}, {radius * 0.92f, 0.03f}}, rim, 28, -1,
          true);
  c.lathe({0, 0.03f, 0}, {{radius * 0.93f, 0}, {0, 0.0001f}}, face, 28, -1, true);
  s.tube({{0, 0, 0.034f}, {0.5f * radius * std::cos(a), 0.5f * radius * std::sin(a), 0.034f}}, 0.003f, hand, 5);
  s.tube({{0, 0, 0.036f}, {0.75f * radius * std::cos(b), 0.75f * radius * std::sin(b), 0.036f}}, 0.002f, hand, 5);
}

void shelf(Shapes& s, float w, const Kit& kit) {
  Random& r = s.random();
  const int wood = s.material(kit.palette->body()), metal = s.material(kit.palette->metal());
  s.box({-w / 2, -0.012f, 0}, {w / 2, 0.012f, 0.22f}, wood);
  for (const float x : {-w * 0.35f, w * 0.35f})
    s.tube({{x, -0.16f, 0.006f}, {x, -0.018f, 0.006f}, {x, -0.018f, 0.2f}}, 0.006f, metal, 6);
  if (r.chance(0.5f)) {
    Shapes row = s.at({-w * 0.45f, 0.012f, 0.1f});
    books(row, kit, w * r.between(0.4f, 0.85f), 0.24f, 0.17f);
  } else {
    Shapes on = s.at({0, 0.012f, 0.11f});
    clutter(on, kit, w * 0.9f, 0.18f, 0.3f, 3);
  }
}

/// Pictures alike in size and frame, in rows.
void gallery(Shapes& s, float w, float h, Palette& palette) {
  Random& r = s.random();
  const int columns = std::max(1, static_cast<int>(w / 0.35f)), rows = std::max(1, static_cast<int>(h / 0.4f));
  const float each = w / static_cast<float>(columns), tall = h / static_cast<float>(rows);
  for (int i = 0; i < columns * rows; ++i) {
    Shapes at = s.at({each * (static_cast<float>(i % columns) + 0.5f) - w / 2,
                      tall * (static_cast<float>(i / columns) + 0.5f) - h / 2, 0});
    picture(at, each * r.between(0.75f, 0.85f), tall * 0.85f, palette, false);
  }
}

void coat_hooks(Shapes& s, float w, const Kit& kit) {
  Random& r = s.random();
  const int wood = s.material(kit.palette->wood()), metal = s.material(kit.palette->chrome());
  s.box({-w / 2, 0, 0}, {w / 2, 0.09f, 0.018f}, wood);
  const int hooks = std::max(2, static_cast<int>(w / 0.18f));
  for (int i = 0; i < hooks; ++i) {
    const float x = w * ((static_cast<float>(i) + 0.5f) / static_cast<float>(hooks) - 0.5f);
    s.tube({{x, 0.05f, 0.018f}, {x, 0.03f, 0.06f}, {x, 0.06f, 0.075f}}, 0.006f, metal, 6);
    if (!r.chance(0.5f)) continue;
    const float long_one = r.between(0.3f, 0.9f);
    s.curtain({x - 0.08f, 0.04f - long_one, 0.06f}, 0.16f, long_one, 0.03f, 2,
              s.material(kit.palette->make(r.chance(0.7f) ? MaterialClass::Fabric : MaterialClass::Leather)));
  }
}

/// A board, or the bare wall, with sheets and cards on it.
void notes(Shapes& s, float w, float h, const Kit& kit) {
  Random& r = s.random();
  const float z = r.chance(0.6f) ? 0.012f : 0.001f;
  if (z > 0.01f) {
    s.box({-w / 2, -h / 2, 0}, {w / 2, h / 2, z},
          s.material(r.chance(0.5f) ? kit.palette->cardboard() : kit.palette->body()));
    frame_around(s, w, h, 0.018f, 0.018f, s.material(kit.palette->metal()));
  }
  for (int i = r.whole(3, 14); i > 0; --i) {  // each a little nearer than the one before
    const float a = r.between(0.03f, 0.12f), b = a * r.between(0.6f, 1.5f), out = z + 0.0006f * static_cast<float>(i);
    const float x = r.between(-1, 1) * std::max(w / 2 - a - 0.02f, 0.f),
                y = r.between(-1, 1) * std::max(h / 2 - b - 0.02f, 0.f);
    s.quad({x - a, y - b, out}, {x + a, y - b, out}, {x + a, y + b, out}, {x - a, y + b, out},
           s.material(r.chance(0.6f) ? kit.palette->label() : kit.palette->make(MaterialClass::Paper)));
  }
}

/// One thing on a stretch of wall, its middle at the origin.
void hang(Shapes& s, float w, float h, const Kit& kit) {
  Random& r = s.random();
  Palette& p = *kit.palette;
  if (p.is_varied() && r.chance(0.15f)) return notes(s, w, h, kit);
  const float choice = r.unit();
  if (choice < 0.42f) return picture(s, w, h, p, false);
  if (choice < 0.5f) return picture(s, w, h, p, true);
  if (choice < 0.55f) return round_mirror(s, std::min(w, h) * 0.45f, p);
  if (choice < 0.65f) return poster(s, w, h, p);
  if (choice < 0.8f) return shelf(s, w, kit);
  if (choice < 0.87f && w > 0.6f) return gallery(s, w, h, p);
  if (choice < 0.92f) return wall_clock(s, std::clamp(w * 0.3f, 0.1f, 0.2f), p);
  if (choice < 0.96f) return wall_lamp(s, kit);
  Shapes low = s.at({0, 0.1f, 0});
  coat_hooks(low, w, kit);
}

bool none_taken(const Wall& wall, float x0, float x1) {
  return std::none_of(wall.taken.begin(), wall.taken.end(),
                      [&](const Wall::Taken& t) { return x1 > t.x0 && x0 < t.x1; });
}

void dress_window(Shapes& s, Wall& wall, const Opening& o, const Kit& kit) {
  Random& r = s.random();
  if (none_taken(wall, o.x0, o.x1) && o.y0 > 0.4f && r.chance(0.4f)) radiator(s, o, s.material(kit.palette->enamel()));
  const bool room =
      none_taken(wall, o.x0 - 0.4f, o.x1 + 0.4f) && o.x0 > -wall.length / 2 + 0.4f && o.x1 < wall.length / 2 - 0.4f;
  const bool apart = std::none_of(wall.openings.begin(), wall.openings.end(), [&](const Opening& other) {
    return other.x0 != o.x0 && other.x1 > o.x0 - 0.4f && other.x0 < o.x1 + 0.4f;
  });
  if (room && apart && r.chance(0.6f)) {
    curtains(s, o, wall.height, kit);
    wall.taken.push_back({o.x0 - 0.35f, o.x1 + 0.35f, wall.height});
  } else if (r.chance(0.45f)) {
    blind(s, o, kit);
  }
  if (o.y0 > 0.5f && r.chance(0.4f)) {  // things on the sill
    Shapes on = s.at({(o.x0 + o.x1) / 2, o.y0 + 0.005f, -0.03f});
    const float h = 0.25f;
    if (r.chance(0.5f))
      potted_plant(on, kit, 0.045f, h);
    else
      clutter(on, kit, (o.x1 - o.x0) * 0.8f, 0.08f, h, 2);
  }
}

/// Switches beside doors, sockets near the floor.
void fittings(Shapes& s, const Wall& wall, int plate) {
  Random& r = s.random();
  const auto put = [&](float x, float y, float w) {
    s.box({x - w / 2, y - 0.04f, 0}, {x + w / 2, y + 0.04f, 0.01f}, plate);
    s.box({x - w / 2 + 0.01f, y - 0.025f, 0.01f}, {x + w / 2 - 0.01f, y + 0.025f, 0.014f}, plate);
  };
  for (const Opening& o : wall.openings)
    if (o.kind == Opening::Door) {
      const float x = r.chance(0.5f) ? o.x1 + 0.16f : o.x0 - 0.16f;
      if (std::abs(x) < wall.length / 2 - 0.05f && wall.is_free(x - 0.05f, x + 0.05f, 0.5f)) put(x, 1.1f, 0.08f);
    }
  for (int i = r.whole(0, 2); i > 0; --i) {
    const float x = r.between(-0.45f, 0.45f) * wall.length;
    if (wall.is_free(x - 0.1f, x + 0.1f, 0.05f)) put(x, 0.3f, r.one_of({0.08f, 0.15f}));
  }
}

void fill_niche(Shapes& s, const Opening& o, const Kit& kit) {
  Random& r = s.random();
  const float w = o.x1 - o.x0, h = o.y1 - o.y0;
  if (o.y0 == 0.f && w > 0.9f && o.depth > 0.35f && r.chance(0.4f)) {  // a seat
    const int wood = s.material(kit.palette->body()), cloth = s.material(kit.palette->fabric());
    s.box({-w / 2, 0, -o.depth}, {w / 2, 0.42f, -0.02f}, wood);
    s.cushion({-w / 2 + 0.02f, 0.42f, -o.depth + 0.01f}, {w / 2 - 0.02f, 0.5f, -0.03f}, 0.035f, cloth, 3);
    return;
  }
  const int board = s.material(kit.palette->body());
  const int shelves = std::max(1, static_cast<int>(h / r.between(0.32f, 0.5f)));
  for (int i = 0; i < shelves; ++i) {
    const float y = h * static_cast<float>(i) / static_cast<float>(shelves),
                room = h / static_cast<float>(shelves) - 0.05f;
    if (i > 0) s.box({-w / 2, y - 0.02f, -o.depth}, {w / 2, y, -0.02f}, board);
    if (y < 0.05f && o.y0 == 0.f) continue;
    Shapes at = s.at({-w / 2 + 0.02f, y, -o.depth / 2});
    Shapes middle = s.at({0, y, -o.depth / 2});
    if (r.chance(0.55f))
      books(at, kit, (w - 0.04f) * r.between(0.4f, 1.f), std::min(room - 0.02f, 0.28f),
            std::min(o.depth - 0.05f, 0.2f));
    else
      clutter(middle, kit, w * 0.85f, o.depth * 0.7f, room, r.whole(1, 3));
  }
}

}  // namespace

void furnish_recesses(Shapes& room, const std::vector<Wall>& walls, const Kit& kit) {
  for (const Wall& wall : walls)
    for (const Opening& o : wall.openings) {
      Shapes s = room.at(glm::mat4(wall.to_room));
      Shapes at = s.at({(o.x0 + o.x1) / 2, o.y0, 0});
      if (o.kind == Opening::Niche) fill_niche(at, o, kit);
      if (o.kind == Opening::Passage && at.random().chance(kit.lamp_on)) {
        Random& r = at.random();
        const int light = at.emitter({lamp_color(r, *kit.palette) * (r.between(4.f, 10.f) * kit.lamp_power), false});
        at.lathe({0, o.y1 - 0.07f, -o.depth * 0.55f}, {{0.12f, 0}, {0.12f, 0.069f}},
                 at.material(kit.palette->diffuser()), 20, light);
      }
    }
}

void decorate_walls(Shapes& room, std::vector<Wall>& walls, const Kit& kit) {
  const int plate = room.material(kit.palette->enamel());
  for (Wall& wall : walls) {
    if (wall.behind == Opening::Niche) continue;
    Shapes s = room.at(wall.to_room);
    Random& r = s.random();
    for (const Opening& o : wall.openings)
      if (o.kind == Opening::Window) dress_window(s, wall, o, kit);
    fittings(s, wall, plate);
    for (int tries = r.whole(1, 7); tries > 0; --tries) {
      const float w = r.between(0.25f, 1.2f), h = w * r.between(0.6f, 1.4f), y = r.between(1.3f, 1.7f);
      if (y + h / 2 > wall.height - 0.15f || wall.length < w + 0.4f) continue;
      const float x = r.between(-wall.length / 2 + w / 2 + 0.15f, wall.length / 2 - w / 2 - 0.15f);
      if (!wall.is_free(x - w / 2 - 0.12f, x + w / 2 + 0.12f, std::min(y - h / 2 - 0.08f, y - 0.3f))) continue;
      wall.taken.push_back({x - w / 2 - 0.1f, x + w / 2 + 0.1f, y + h / 2});
      Shapes at = s.at({x, y, 0});
      hang(at, w, h, kit);
    }
  }
}

}  // namespace clerestory
