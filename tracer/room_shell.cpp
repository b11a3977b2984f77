#include "tracer/room_shell.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

namespace clerestory {
namespace {

constexpr float kHalfTurn = std::numbers::pi_v<float>;

/// A part of a wall's surface; texture coordinates run through all parts.
void surface(Shapes& s, const Wall& wall, float x0, float y0, float x1, float y1, int material) {
  if (x1 - x0 < 1e-4f || y1 - y0 < 1e-4f) return;
  s.quad({x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0}, material, -1, {x0 + wall.length / 2, y0});
}

void wall_surface(Shapes& s, const Wall& wall, float height, int material) {
  float x = -wall.length / 2;
  for (const Opening& o : wall.openings) {
    surface(s, wall, x, 0, o.x0, height, material);
    surface(s, wall, o.x0, 0, o.x1, o.y0, material);
    surface(s, wall, o.x0, o.y1, o.x1, height, material);
    x = o.x1;
  }
  surface(s, wall, x, 0, wall.length / 2, height, material);
}

/// The four sides of an opening, `depth` into the wall.
void reveal(Shapes& s, const Opening& o, float depth, int material) {
  s.quad({o.x0, o.y0, -depth}, {o.x0, o.y0, 0}, {o.x0, o.y1, 0}, {o.x0, o.y1, -depth}, material);
  s.quad({o.x1, o.y0, 0}, {o.x1, o.y0, -depth}, {o.x1, o.y1, -depth}, {o.x1, o.y1, 0}, material);
  s.quad({o.x0, o.y1, 0}, {o.x1, o.y1, 0}, {o.x1, o.y1, -depth}, {o.x0, o.y1, -depth}, material);
  s.quad({o.x0, o.y0, -depth}, {o.x1, o.y0, -depth}, {o.x1, o.y0, 0}, {o.x0, o.y0, 0}, material);
}

void window(Shapes& s, const Opening& o, int wall, int frame, int pane, int light) {
  Random& r = s.random();
  const float depth = r.between(0.1f, 0.28f), bar = r.between(0.035f, 0.06f);
  reveal(s, o, depth, wall);
  const float z0 = -depth, z1 = -depth + 0.05f;
  s.box({o.x0, o.y0, z0}, {o.x0 + bar, o.y1, z1}, frame);
  s.box({o.x1 - bar, o.y0, z0}, {o.x1, o.y1, z1}, frame);
  s.box({o.x0 + bar, o.y0, z0}, {o.x1 - bar, o.y0 + bar, z1}, frame);
  s.box({o.x0 + bar, o.y1 - bar, z0}, {o.x1 - bar, o.y1, z1}, frame);
  const int columns = std::max(1, static_cast<int>((o.x1 - o.x0) / r.between(0.55f, 1.1f))),
            rows = r.chance(0.3f) ? 2 : 1;
  for (int i = 1; i < columns; ++i) {
    const float x = o.x0 + (o.x1 - o.x0) * static_cast<float>(i) / static_cast<float>(columns);
    s.box({x - bar / 2, o.y0 + bar, z0}, {x + bar / 2, o.y1 - bar, z1}, frame);
  }
  if (rows == 2) {
    const float y = o.y0 + (o.y1 - o.y0) * r.between(0.5f, 0.75f);
    s.box({o.x0 + bar, y - bar / 2, z0 + 0.001f}, {o.x1 - bar, y + bar / 2, z1 - 0.001f}, frame);
  }
  s.quad({o.x0, o.y0, z0 + 0.015f}, {o.x1, o.y0, z0 + 0.015f}, {o.x1, o.y1, z0 + 0.015f}, {o.x0, o.y1, z0 + 0.015f},
         pane, light);
  s.box({o.x0 - 0.04f, o.y0 - 0.025f, -depth + 0.05f}, {o.x1 + 0.04f, o.y0 + 0.004f, 0.04f}, frame);  // sill
}

void door(Shapes& s, const Opening& o, int wall, int frame, int leaf, int metal) {
  reveal(s, o, 0.12f, wall);
  const float casing = 0.07f, z = -0.03f;
  s.box({o.x0 - casing, 0, 0}, {o.x0, o.y1 + casing, 0.015f}, frame);
  s.box({o.x1, 0, 0}, {o.x1 + casing, o.y1 + casing, 0.015f}, frame);
  s.box({o.x0, o.y1, 0}, {o.x1, o.y1 + casing, 0.015f}, frame);
  s.box({o.x0, o.y0, z - 0.04f}, {o.x1, o.y1, z}, leaf);
  Random& r = s.random();
  const int panels = r.whole(0, 2);
  for (int i = 0; i < panels; ++i) {  // mouldings
    const float y0 = 0.15f + (o.y1 - 0.3f) * static_cast<float>(i) / static_cast<float>(panels) + 0.04f;
    const float y1 = 0.15f + (o.y1 - 0.3f) * static_cast<float>(i + 1) / static_cast<float>(panels) - 0.04f;
    const float x0 = o.x0 + 0.13f, x1 = o.x1 - 0.13f, b = 0.025f;
    s.box({x0, y0, z}, {x1, y0 + b, z + 0.008f}, leaf);
    s.box({x0, y1 - b, z}, {x1, y1, z + 0.008f}, leaf);
    s.box({x0, y0 + b, z}, {x0 + b, y1 - b, z + 0.008f}, leaf);
    s.box({x1 - b, y0 + b, z}, {x1, y1 - b, z + 0.008f}, leaf);
  }
  const float x = r.chance(0.5f) ? o.x0 + 0.07f : o.x1 - 0.07f, inwards = x < (o.x0 + o.x1) / 2 ? 1.f : -1.f;
  s.box({x - 0.02f, 0.93f, z}, {x + 0.02f, 1.13f, z + 0.006f}, metal);
  s.rod({x, 1.05f, z}, {x, 1.05f, z + 0.05f}, 0.018f, metal);
  s.rod({x - inwards * 0.009f, 1.05f, z + 0.05f}, {x + inwards * 0.12f, 1.05f, z + 0.05f}, 0.018f, metal);
}

void skirting(Shapes& s, const Wall& wall, float height, int material) {
  float x = -wall.length / 2;
  for (const Opening& o : wall.openings) {
    if (o.window) continue;
    if (o.x0 - 0.07f > x) s.box({x, 0, 0}, {o.x0 - 0.07f, height, 0.012f}, material);
    x = o.x1 + 0.07f;
  }
  if (x < wall.length / 2) s.box({x, 0, 0}, {wall.length / 2, height, 0.012f}, material);
}

void picture(Shapes& s, float x, float y, float w, float h, Palette& palette, bool mirror) {
  Random& r = s.random();
  const float bar = r.between(0.012f, 0.05f), out = r.between(0.015f, 0.03f);
  const int frame = s.material(r.chance(0.5f)   ? palette.wood()
                               : r.chance(0.5f) ? palette.metal()
                                                : palette.make(MaterialClass::GlossPaint));
  s.box({x - w / 2, y - h / 2, 0}, {x + w / 2, y - h / 2 + bar, out}, frame);
  s.box({x - w / 2, y + h / 2 - bar, 0}, {x + w / 2, y + h / 2, out}, frame);
  s.box({x - w / 2, y - h / 2 + bar, 0}, {x - w / 2 + bar, y + h / 2 - bar, out}, frame);
  s.box({x + w / 2 - bar, y - h / 2 + bar, 0}, {x + w / 2, y + h / 2 - bar, out}, frame);
  const float z = out * 0.5f, mat = !mirror && r.chance(0.5f) ? bar + std::min(w, h) * 0.14f : bar;
  if (mat > bar) {
    s.quad({x - w / 2 + bar, y - h / 2 + bar, z - 0.002f}, {x + w / 2 - bar, y - h / 2 + bar, z - 0.002f},
           {x + w / 2 - bar, y + h / 2 - bar, z - 0.002f}, {x - w / 2 + bar, y + h / 2 - bar, z - 0.002f},
           s.material(palette.ceiling()));
  }
  s.canvas({x - w / 2 + mat, y - h / 2 + mat, z}, {x + w / 2 - mat, y - h / 2 + mat, z},
           {x + w / 2 - mat, y + h / 2 - mat, z}, {x - w / 2 + mat, y + h / 2 - mat, z},
           s.material(mirror ? palette.mirror() : palette.painting()));
}

void radiator(Shapes& s, const Opening& o, int material) {
  const float x0 = o.x0 + 0.1f, x1 = o.x1 - 0.1f, top = std::min(o.y0 - 0.12f, 0.7f);
  if (x1 - x0 < 0.4f || top < 0.35f) return;
  const int fins = static_cast<int>((x1 - x0) / 0.06f);
  for (int i = 0; i < fins; ++i) {
    const float x = x0 + 0.06f * static_cast<float>(i);
    s.box({x, 0.12f, 0.03f}, {x + 0.045f, top, 0.12f}, material);
  }
  s.box({x0, top - 0.05f, 0.05f}, {x1, top - 0.02f, 0.1f}, material);
  s.box({x0, 0.14f, 0.05f}, {x1, 0.17f, 0.1f}, material);
}

void curtains(Shapes& s, const Opening& o, float height, const Kit& kit) {
  Random& r = s.random();
  const int cloth = s.material(kit.palette->fabric()), metal = s.material(kit.palette->metal());
  const float top = std::min(o.y1 + 0.15f, height - 0.06f), low = r.chance(0.6f) ? 0.03f : o.y0 - 0.15f;
  s.rod({o.x0 - 0.35f, top, 0.09f}, {o.x1 + 0.35f, top, 0.09f}, 0.022f, metal);
  const float wide = std::clamp((o.x1 - o.x0) * r.between(0.16f, 0.4f), 0.2f, 0.7f);
  const int folds = std::max(2, static_cast<int>(wide / 0.09f));
  s.curtain({o.x0 - 0.25f, low, 0.09f}, wide, top - low - 0.01f, 0.03f, folds, cloth);
  if (r.chance(0.85f)) s.curtain({o.x1 + 0.25f - wide, low, 0.09f}, wide, top - low - 0.01f, 0.03f, folds, cloth);
}

}  // namespace

bool Wall::is_free(float x0, float x1, float above) const {
  for (const Opening& o : openings) {
    if (x1 > o.x0 && x0 < o.x1 && o.y1 > above) return false;
  }
  return std::none_of(taken.begin(), taken.end(),
                      [&](const Taken& t) { return x1 > t.x0 && x0 < t.x1 && t.height > above; });
}

std::vector<Wall> make_walls(const glm::vec3& size) {
  std::vector<Wall> walls(4);
  for (int k = 0; k < 4; ++k) {
    Wall& w = walls[static_cast<std::size_t>(k)];
    w.length = k % 2 ? size.z : size.x;
    const float away = (k % 2 ? size.x : size.z) / 2;
    w.to_room =
        glm::translate(glm::rotate(glm::mat4(1), kHalfTurn / 2 * static_cast<float>(k), {0, 1, 0}), {0, 0, -away});
  }
  return walls;
}

void choose_openings(std::vector<Wall>& walls, float height, bool windowed, Random& random) {
  const int door_wall = random.whole(0, 3);
  const int first_window = random.whole(0, 3);
  const int window_walls = windowed ? random.whole(1, 2) : 0;
  for (int k = 0; k < 4; ++k) {
    Wall& w = walls[static_cast<std::size_t>(k)];
    const bool has_window =
        window_walls > 0 && (k == first_window || (window_walls == 2 && k == (first_window + 1) % 4));
    float free0 = -w.length / 2 + 0.2f, free1 = w.length / 2 - 0.2f;
    if (k == door_wall) {
      const float width = random.between(0.78f, 0.95f), top = std::min(random.between(1.98f, 2.1f), height - 0.15f);
      const bool left = random.chance(0.5f);
      const float x = left ? free0 + random.between(0, 0.3f) : free1 - width - random.between(0, 0.3f);
      w.openings.push_back({x, 0, x + width, top, false});
      (left ? free0 : free1) = left ? x + width + 0.25f : x - 0.25f;
    }
    if (!has_window || free1 - free0 < 0.7f) continue;
    const float sill = random.chance(0.2f) ? random.between(0.05f, 0.3f) : random.between(0.7f, 1.0f);
    const float top = std::min(sill + random.between(1.1f, 1.6f), height - 0.15f);
    const int count = free1 - free0 > 3.2f && random.chance(0.6f) ? 2 : 1;
    const float each = (free1 - free0) / static_cast<float>(count);
    const float width = std::clamp(each * random.between(0.45f, 0.85f), 0.6f, 2.4f);
    for (int i = 0; i < count; ++i) {
      const float slack = each - width,
                  x = free0 + each * static_cast<float>(i) + slack * (count == 1 ? random.between(0.2f, 0.8f) : 0.5f);
      w.openings.push_back({x, sill, x + width, top, true});
    }
  }
  for (Wall& w : walls) {
    std::sort(w.openings.begin(), w.openings.end(), [](const Opening& a, const Opening& b) { return a.x0 < b.x0; });
  }
}

void build_shell(Shapes& room, std::vector<Wall>& walls, const glm::vec3& size, Palette& palette,
                 const ShellStyle& style) {
  Random& r = room.random();
  const float x = size.x / 2, z = size.z / 2, h = size.y;
  const bool turned = r.chance(0.5f);
  const int floor = room.material(palette.floor()), ceiling = room.material(palette.ceiling());
  if (turned)
    room.quad({x, 0, z}, {x, 0, -z}, {-x, 0, -z}, {-x, 0, z}, floor);
  else
    room.quad({-x, 0, z}, {x, 0, z}, {x, 0, -z}, {-x, 0, -z}, floor);
  room.quad({-x, h, -z}, {x, h, -z}, {x, h, z}, {-x, h, z}, ceiling);

  const int paint = room.material(palette.wall()), accent = r.chance(0.3f) ? room.material(palette.wall()) : paint;
  const int accent_wall = r.whole(0, 3);
  const int frame = room.material(r.chance(0.7f) ? palette.make(MaterialClass::GlossPaint) : palette.wood());
  const int leaf = r.chance(0.6f) ? frame : room.material(palette.wood());
  const int metal = room.material(palette.metal()), pane = room.material(palette.glass());
  const float skirt = r.between(0.05f, 0.12f);
  for (int k = 0; k < 4; ++k) {
    Wall& wall = walls[static_cast<std::size_t>(k)];
    Shapes s = room.at(wall.to_room);
    const int surface_of = k == accent_wall ? accent : paint;
    wall_surface(s, wall, h, surface_of);
    skirting(s, wall, skirt, frame);
    // Panes of different walls face different ways: an emitter each.
    const int pane_light = style.daylight > 0 ? s.emitter({glm::vec3(style.daylight), true}) : -1;
    for (const Opening& o : wall.openings) {
      if (o.window)
        window(s, o, surface_of, frame, pane, pane_light);
      else
        door(s, o, surface_of, frame, leaf, metal);
    }
  }
  if (r.chance(0.2f)) {  // beams
    const int beam = room.material(palette.wood());
    const float step = r.between(0.7f, 1.1f), drop = r.between(0.1f, 0.2f);
    for (float at = -z + step / 2; at < z - 0.1f; at += step) room.box({-x, h - drop, at}, {x, h, at + 0.1f}, beam);
  } else if (r.chance(0.4f)) {  // cornice
    const int white = room.material(palette.ceiling());
    for (const Wall& wall : walls) {
      Shapes s = room.at(wall.to_room);
      s.box({-wall.length / 2, h - 0.07f, 0}, {wall.length / 2, h, 0.05f}, white);
      s.box({-wall.length / 2, h - 0.1f, 0}, {wall.length / 2, h - 0.07f, 0.02f}, white);
    }
  }
}

void build_ceiling_lamps(Shapes& room, const glm::vec3& size, Palette& palette, const ShellStyle& style,
                         const glm::vec2& over) {
  Random& r = room.random();
  const float h = size.y;
  const int metal = room.material(palette.metal()), shade = room.material(palette.diffuser());
  const glm::vec3 color = lamp_color(r) * style.lamp_power;
  const auto lit = [&](float low, float high) {
    const float strength = r.between(low, high);
    return style.lamps_on ? room.emitter({color * strength, false}) : -1;
  };
  switch (r.whole(0, 4)) {
    case 0: {  // flat panels
      const int columns = size.x > 4.5f ? 2 : 1, rows = size.z > 4.5f ? 2 : 1, light = lit(4, 9);
      const float w = r.one_of({0.3f, 0.6f}), d = r.one_of({0.6f, 1.2f});
      for (int i = 0; i < columns; ++i) {
        for (int k = 0; k < rows; ++k) {
          const float x = size.x * ((static_cast<float>(i) + 0.5f) / static_cast<float>(columns) - 0.5f);
          const float z = size.z * ((static_cast<float>(k) + 0.5f) / static_cast<float>(rows) - 0.5f);
          room.box({x - w / 2 - 0.02f, h - 0.06f, z - d / 2 - 0.02f},
                   {x + w / 2 + 0.02f, h - 0.001f, z + d / 2 + 0.02f}, metal);
          room.quad({x - w / 2, h - 0.062f, z - d / 2}, {x + w / 2, h - 0.062f, z - d / 2},
                    {x + w / 2, h - 0.062f, z + d / 2}, {x - w / 2, h - 0.062f, z + d / 2}, shade, light);
        }
      }
      return;
    }
    case 1: {  // a globe on a cable
      const float radius = r.between(0.1f, 0.2f), y = h - r.between(0.35f, 0.8f);
      room.rod({over.x, y + radius, over.y}, {over.x, h, over.y}, 0.012f, metal);
      room.sphere({over.x, y, over.y}, radius, shade, 10, lit(8, 16));
      return;
    }
    case 2: {  // pendants of sheet metal in a row, light below
      const int count = r.whole(1, 3), light = lit(7, 15);
      const float y = h - r.between(0.6f, 1.0f);
      for (int i = 0; i < count; ++i) {
        const float x = over.x + 0.45f * (static_cast<float>(i) - 0.5f * static_cast<float>(count - 1));
        Shapes s = room.at({x, y, over.y});
        s.rod({0, 0.2f, 0}, {0, h - y, 0}, 0.01f, metal);
        s.lathe({0, 0, 0}, {{0.16f, 0}, {0.11f, 0.1f}, {0.04f, 0.2f}, {0, 0.21f}}, metal, 24, -1, true);
        s.disc({0, 0.01f, 0}, 0.155f, shade, 24, light);
      }
      return;
    }
    case 3: {  // spots let into the ceiling
      const int columns = std::max(2, static_cast<int>(size.x / 1.3f)),
                rows = std::max(2, static_cast<int>(size.z / 1.4f));
      const int light = lit(15, 35);
      for (int i = 0; i < columns; ++i) {
        for (int k = 0; k < rows; ++k) {
          const float x = size.x * ((static_cast<float>(i) + 0.5f) / static_cast<float>(columns) - 0.5f);
          const float z = size.z * ((static_cast<float>(k) + 0.5f) / static_cast<float>(rows) - 0.5f);
          room.lathe({x, h - 0.014f, z}, {{0.055f, 0}, {0.06f, 0.013f}}, metal, 16);
          room.disc({x, h - 0.0145f, z}, 0.05f, shade, 16, light);
        }
      }
      return;
    }
    default: {  // a flush drum
      const float radius = r.between(0.18f, 0.28f);
      room.lathe({over.x * 0.5f, h - 0.1f, over.y * 0.5f}, {{radius, 0}, {radius, 0.09f}}, shade, 28, lit(4, 9));
      return;
    }
  }
}

void decorate_walls(Shapes& room, std::vector<Wall>& walls, float height, const Kit& kit) {
  for (Wall& wall : walls) {
    Shapes s = room.at(wall.to_room);
    Random& r = s.random();
    for (const Opening& o : wall.openings) {
      if (!o.window) continue;
      if (wall.is_free(o.x0, o.x1, 0.1f) || o.y0 > 0.4f) {
        const bool below_free = std::none_of(wall.taken.begin(), wall.taken.end(),
                                             [&](const Wall::Taken& t) { return o.x1 > t.x0 && o.x0 < t.x1; });
        if (below_free && r.chance(0.4f)) radiator(s, o, s.material(kit.palette->make(MaterialClass::GlossPaint)));
      }
      const bool sides_free = std::none_of(wall.taken.begin(), wall.taken.end(), [&](const Wall::Taken& t) {
        return o.x1 + 0.4f > t.x0 && o.x0 - 0.4f < t.x1;
      });
      if (sides_free && o.x0 > -wall.length / 2 + 0.4f && o.x1 < wall.length / 2 - 0.4f && r.chance(0.5f))
        curtains(s, o, height, kit);
    }
    for (int tries = r.whole(1, 6); tries > 0; --tries) {
      const float w = r.between(0.25f, 1.1f), h = w * r.between(0.65f, 1.4f), y = r.between(1.35f, 1.65f);
      if (y + h / 2 > height - 0.15f || wall.length < w + 0.4f) continue;
      const float x = r.between(-wall.length / 2 + w / 2 + 0.15f, wall.length / 2 - w / 2 - 0.15f);
      if (!wall.is_free(x - w / 2 - 0.12f, x + w / 2 + 0.12f, y - h / 2 - 0.08f)) continue;
      wall.taken.push_back({x - w / 2 - 0.1f, x + w / 2 + 0.1f, y + h / 2});
      const float choice = r.unit();
      if (choice < 0.75f) {
        picture(s, x, y, w, h, *kit.palette, false);
      } else if (choice < 0.87f) {
        picture(s, x, y, w, h, *kit.palette, true);
      } else {  // a board with things on it
        s.box({x - w / 2, y - 0.012f, 0}, {x + w / 2, y + 0.012f, 0.2f}, s.material(kit.palette->wood()));
        Shapes on = s.at({x, y + 0.012f, 0.1f});
        clutter(on, kit, w * 0.9f, 0.18f, 0.3f, 3);
      }
    }
  }
}

}  // namespace clerestory
