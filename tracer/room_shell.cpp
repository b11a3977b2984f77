#include "tracer/room_shell.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "tracer/openings.hpp"

namespace clerestory {
namespace {

constexpr float kHalfTurn = std::numbers::pi_v<float>;

/// A part of a wall's surface; texture coordinates run through all parts, far from zero, where a wallpaper's borders
/// would be.
void surface(Shapes& s, const Wall& wall, float x0, float y0, float x1, float y1, int material) {
  if (x1 - x0 < 1e-4f || y1 - y0 < 1e-4f) return;
  s.quad({x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0}, material, -1, {x0 + wall.length / 2 + 8, y0});
}

void wall_surface(Shapes& s, const Wall& wall, int material) {
  float x = -wall.length / 2;
  for (const Opening& o : wall.openings) {
    surface(s, wall, x, 0, o.x0, wall.height, material);
    surface(s, wall, o.x0, 0, o.x1, o.y0, material);
    surface(s, wall, o.x0, o.y1, o.x1, wall.height, material);
    x = o.x1;
  }
  surface(s, wall, x, 0, wall.length / 2, wall.height, material);
}

/// Runs of wall near the floor, between what is open there.
template <class Run>
void along_foot(const Wall& wall, float casing, Run&& run) {
  float x = -wall.length / 2;
  for (const Opening& o : wall.openings) {
    if (o.kind == Opening::Window || o.y0 > 0) continue;
    const float edge = o.kind == Opening::Door || o.kind == Opening::Passage ? casing : 0;
    if (o.x0 - edge > x) run(x, o.x0 - edge);
    x = o.x1 + edge;
  }
  if (x < wall.length / 2) run(x, wall.length / 2);
}

/// Boards up to a rail, where no window comes down to it.
void panelling(Shapes& s, const Wall& wall, float height, int material) {
  for (const Opening& o : wall.openings)
    if (o.kind == Opening::Window && o.y0 < height + 0.05f) return;
  const float board = s.random().between(0.08f, 0.6f);
  along_foot(wall, kCasing, [&](float x0, float x1) {
    s.box({x0, 0, 0}, {x1, height, 0.008f}, material);
    s.box({x0, height, 0}, {x1, height + 0.04f, 0.025f}, material);
    const int boards = static_cast<int>((x1 - x0) / board);
    for (int i = 1; i < boards; ++i) {
      const float x = x0 + (x1 - x0) * static_cast<float>(i) / static_cast<float>(boards);
      s.box({x - 0.012f, 0.1f, 0.008f}, {x + 0.012f, height, 0.014f}, material);
    }
  });
}

struct ShellMaterials {
  int frame, leaf, metal, pane, glow;
};

void build_wall(Shapes& s, const Wall& wall, int surface_of, const ShellMaterials& m) {
  wall_surface(s, wall, surface_of);
  for (const Opening& o : wall.openings) {
    if (o.kind == Opening::Window) window(s, o, surface_of, m.frame, m.metal, m.pane, m.glow);
    if (o.kind == Opening::Door) door(s, o, surface_of, m.frame, m.leaf, m.metal, m.pane);
    if (o.kind == Opening::Passage) casing(s, o, m.frame);
    if (o.is_recess()) recess_sides(s, o, surface_of);
  }
}

void build_floor(Shapes& room, const Floor& f, const Floor& first, int floor, int ceiling, bool turned) {
  // Texture coordinates run on from the room's own floor into its recesses.
  if (turned)
    room.quad({f.x1, 0, f.z1}, {f.x1, 0, f.z0}, {f.x0, 0, f.z0}, {f.x0, 0, f.z1}, floor, -1,
              {first.z1 - f.z1, first.x1 - f.x1});
  else
    room.quad({f.x0, 0, f.z1}, {f.x1, 0, f.z1}, {f.x1, 0, f.z0}, {f.x0, 0, f.z0}, floor, -1,
              {f.x0 - first.x0, first.z1 - f.z1});
  room.quad({f.x0, f.height, f.z0}, {f.x1, f.height, f.z0}, {f.x1, f.height, f.z1}, {f.x0, f.height, f.z1}, ceiling);
}

void beams(Shapes& room, const Floor& f, Palette& palette) {
  Random& r = room.random();
  const int beam = room.material(palette.wood());
  const float step = r.between(0.7f, 1.1f), drop = r.between(0.1f, 0.2f);
  for (float at = f.z0 + step / 2; at < f.z1 - 0.1f; at += step)
    room.box({f.x0, f.height - drop, at}, {f.x1, f.height, at + 0.1f}, beam);
}

void cornice(Shapes& room, const std::vector<Wall>& walls, int white) {
  for (const Wall& wall : walls) {
    if (wall.behind != Opening::Door) continue;
    Shapes s = room.at(wall.to_room);
    const float h = wall.height;
    s.box({-wall.length / 2, h - 0.07f, 0}, {wall.length / 2, h, 0.05f}, white);
    s.box({-wall.length / 2, h - 0.1f, 0}, {wall.length / 2, h - 0.07f, 0.02f}, white);
  }
}

/// The wall at the back of a recess.
Wall back_of(const Wall& wall, const Opening& o) {
  Wall back;
  back.to_room = glm::translate(wall.to_room, {(o.x0 + o.x1) / 2, o.y0, -o.depth});
  back.length = o.x1 - o.x0, back.height = o.y1 - o.y0, back.behind = o.kind;
  return back;
}

/// A stretch of a wall in which nothing has been opened yet.
struct Stretch {
  float x0, x1;
  float length() const { return x1 - x0; }
};

void open_door(Wall& w, Stretch& free, Random& random) {
  const float width = random.between(0.78f, 0.95f), top = std::min(random.between(1.98f, 2.1f), w.height - 0.15f);
  const bool left = random.chance(0.5f);
  const float x = left ? free.x0 + random.between(0, 0.3f) : free.x1 - width - random.between(0, 0.3f);
  w.openings.push_back({x, 0, x + width, top, Opening::Door});
  (left ? free.x0 : free.x1) = left ? x + width + 0.25f : x - 0.25f;
}

/// Windows beside it keep half of the stretch.
void open_recess(Wall& w, Stretch& free, bool beside_windows, Random& random) {
  const float choice = random.unit();
  Opening o{0, 0, 0, 0, choice < 0.5f ? Opening::Bay : choice < 0.75f ? Opening::Niche : Opening::Passage};
  float width = 0;
  if (o.kind == Opening::Bay) {
    width = random.between(1.6f, 3.2f), o.depth = random.between(0.7f, 2.2f);
    o.y1 = w.height - (random.chance(0.4f) ? random.between(0.15f, 0.4f) : 0.f);
  } else if (o.kind == Opening::Niche) {
    width = random.between(0.7f, 1.5f), o.depth = random.between(0.22f, 0.5f);
    o.y0 = random.chance(0.4f) ? random.between(0.5f, 1.f) : 0.f;
    o.y1 = std::min(o.y0 + random.between(1.f, 2.3f), w.height - 0.2f);
  } else {
    width = random.between(0.85f, 1.4f), o.depth = random.between(1.2f, 2.6f);
    o.y1 = std::min(random.between(2.f, 2.2f), w.height - 0.1f);
  }
  width = std::min(width, beside_windows ? free.length() / 2 - 0.3f : free.length() - 0.1f);
  // A bay in the corner makes an L.
  const bool corner = o.kind == Opening::Bay && random.chance(0.6f), left = random.chance(0.5f);
  const float place = corner || beside_windows ? (left ? 0.f : 1.f) : random.unit();
  o.x0 = free.x0 + place * (free.length() - width), o.x1 = o.x0 + width;
  if (corner && left && free.x0 < -w.length / 2 + 0.25f) o.x0 = -w.length / 2;
  if (corner && !left && free.x1 > w.length / 2 - 0.25f) o.x1 = w.length / 2;
  if (place < 0.5f)
    free.x0 = o.x1 + 0.25f;
  else
    free.x1 = o.x0 - 0.25f;
  w.openings.push_back(o);
}

void open_windows(Wall& w, const Stretch& free, Random& random) {
  const bool tall = random.chance(0.25f);
  const float sill = tall ? random.between(0.04f, 0.3f) : random.between(0.7f, 1.0f);
  const float top = std::min(tall ? random.between(2.f, 2.3f) : sill + random.between(1.1f, 1.6f), w.height - 0.12f);
  const int count = free.length() > 3.2f && random.chance(0.6f) ? 2 : 1;
  const float each = free.length() / static_cast<float>(count);
  const float width = std::clamp(each * random.between(0.45f, 0.9f), 0.6f, 2.8f);
  if (width > each) return;
  for (int i = 0; i < count; ++i) {
    const float slack = each - width,
                x = free.x0 + each * static_cast<float>(i) + slack * (count == 1 ? random.between(0.2f, 0.8f) : 0.5f);
    w.openings.push_back({x, sill, x + width, top, Opening::Window});
  }
}

/// Doors of passages, windows of bays.
void open_back(Wall& back, bool windowed, Random& random) {
  Stretch free{-back.length / 2 + 0.05f, back.length / 2 - 0.05f};
  if (back.behind == Opening::Passage && back.length > 0.95f && random.chance(0.7f)) {
    const float half = std::min(0.42f, back.length / 2 - 0.08f);
    back.openings.push_back({-half, 0, half, std::min(2.f, back.height - 0.08f), Opening::Door});
  }
  if (back.behind == Opening::Bay && windowed && random.chance(0.5f)) open_windows(back, free, random);
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
    w.length = k % 2 ? size.z : size.x, w.height = size.y;
    const float away = (k % 2 ? size.x : size.z) / 2;
    w.to_room =
        glm::translate(glm::rotate(glm::mat4(1), kHalfTurn / 2 * static_cast<float>(k), {0, 1, 0}), {0, 0, -away});
  }
  return walls;
}

void choose_openings(std::vector<Wall>& walls, float height, bool windowed, bool recesses, Random& random) {
  // The first window is not in the wall of the door, where it might find no place.
  const int door_wall = random.whole(0, 3), first_window = (door_wall + random.whole(1, 3)) % 4;
  const int window_walls = windowed ? random.whole(1, 2) : 0;
  const int recess_wall = recesses && random.chance(0.45f) ? random.whole(0, 3) : -1;
  std::vector<Wall> backs;
  for (int k = 0; k < 4; ++k) {
    Wall& w = walls[static_cast<std::size_t>(k)];
    w.height = height;
    const bool has_window =
        window_walls > 0 && (k == first_window || (window_walls == 2 && k == (first_window + 1) % 4));
    Stretch free{-w.length / 2 + 0.2f, w.length / 2 - 0.2f};
    if (k == door_wall) open_door(w, free, random);
    if (k == recess_wall && free.length() > (has_window ? 3.f : 1.2f)) open_recess(w, free, has_window, random);
    if (has_window && free.length() >= 0.7f) open_windows(w, free, random);
    std::sort(w.openings.begin(), w.openings.end(), [](const Opening& a, const Opening& b) { return a.x0 < b.x0; });
    for (const Opening& o : w.openings)
      if (o.is_recess()) open_back(backs.emplace_back(back_of(w, o)), windowed, random);
  }
  walls.insert(walls.end(), backs.begin(), backs.end());
}

std::vector<Floor> floors_of(const std::vector<Wall>& walls, const glm::vec3& size) {
  std::vector<Floor> floors{{-size.x / 2, -size.z / 2, size.x / 2, size.z / 2, size.y}};
  for (const Wall& wall : walls)
    for (const Opening& o : wall.openings) {
      if (o.kind != Opening::Bay && o.kind != Opening::Passage) continue;
      const glm::vec4 a = wall.to_room * glm::vec4(o.x0, 0, -o.depth, 1), b = wall.to_room * glm::vec4(o.x1, 0, 0, 1);
      floors.push_back({std::min(a.x, b.x), std::min(a.z, b.z), std::max(a.x, b.x), std::max(a.z, b.z), o.y1});
    }
  return floors;
}

void build_shell(Shapes& room, std::vector<Wall>& walls, const std::vector<Floor>& floors, Palette& palette,
                 const ShellStyle& style) {
  Random& r = room.random();
  const bool turned = r.chance(0.5f);
  const int floor = room.material(palette.floor()), ceiling = room.material(palette.ceiling());
  for (const Floor& f : floors) build_floor(room, f, floors[0], floor, ceiling, turned);

  const int paint = room.material(style.tiled_walls ? palette.make(MaterialClass::Tile) : palette.wall());
  const int accent = r.chance(0.3f) ? room.material(palette.wall()) : paint;
  const int accent_wall = r.whole(0, 3);
  ShellMaterials m{};
  m.frame = room.material(r.chance(0.65f) ? palette.make(MaterialClass::GlossPaint) : palette.wood());
  m.leaf = r.chance(0.55f)  ? m.frame
           : r.chance(0.5f) ? room.material(palette.wood())
                            : room.material(palette.make(MaterialClass::GlossPaint));
  m.metal = room.material(palette.metal()), m.pane = room.material(palette.glass());
  const float skirt = r.chance(0.12f) ? 0.f : r.between(0.04f, 0.16f);
  const bool panelled = !style.tiled_walls && r.chance(0.1f);
  for (std::size_t k = 0; k < walls.size(); ++k) {
    const Wall& wall = walls[k];
    Shapes s = room.at(wall.to_room);
    // Panes of different walls face different ways: an emitter each.
    m.glow = style.daylight > 0 ? s.emitter({glm::vec3(style.daylight), true}) : -1;
    build_wall(s, wall, static_cast<int>(k) == accent_wall ? accent : paint, m);
    if (panelled && wall.behind == Opening::Door) panelling(s, wall, 0.95f, m.frame);
    if (skirt > 0 && wall.behind != Opening::Niche)
      along_foot(wall, kCasing, [&](float x0, float x1) { s.box({x0, 0, 0}, {x1, skirt, 0.016f}, m.frame); });
  }
  if (r.chance(0.1f))
    beams(room, floors[0], palette);
  else if (r.chance(0.35f))
    cornice(room, walls, room.material(palette.ceiling()));
}

}  // namespace clerestory
