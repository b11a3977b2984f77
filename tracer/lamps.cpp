// Lamps: at the ceiling, on walls, on tables and floors.
#include <algorithm>
#include <cmath>

#include "tracer/furniture.hpp"
#include "tracer/room_shell.hpp"

namespace clerestory {
namespace {

constexpr float kColouredLamps = 0.1f;

/// Ceiling lamps of one room: all alike.
struct Ceiling {
  Shapes& room;
  const glm::vec3& size;
  int metal, shade;
  glm::vec3 color;
  bool on;

  float height() const { return size.y; }
  int lit(float low, float high) const {
    const float strength = room.random().between(low, high);
    return on ? room.emitter({color * strength, false}) : -1;
  }
  /// In a grid of cells over the ceiling.
  template <class Each>
  void grid(int columns, int rows, Each&& each) const {
    for (int i = 0; i < columns; ++i)
      for (int k = 0; k < rows; ++k)
        each(size.x * ((static_cast<float>(i) + 0.5f) / static_cast<float>(columns) - 0.5f),
             size.z * ((static_cast<float>(k) + 0.5f) / static_cast<float>(rows) - 0.5f));
  }

  void panels() const {
    Random& r = room.random();
    const int light = lit(4, 9);
    const float w = r.one_of({0.3f, 0.6f}), d = r.one_of({0.6f, 1.2f}), h = height();
    grid(size.x > 4.5f ? 2 : 1, size.z > 4.5f ? 2 : 1, [&](float x, float z) {
      room.box({x - w / 2 - 0.02f, h - 0.06f, z - d / 2 - 0.02f}, {x + w / 2 + 0.02f, h - 0.001f, z + d / 2 + 0.02f},
               metal);
      room.quad({x - w / 2, h - 0.062f, z - d / 2}, {x + w / 2, h - 0.062f, z - d / 2},
                {x + w / 2, h - 0.062f, z + d / 2}, {x - w / 2, h - 0.062f, z + d / 2}, shade, light);
    });
  }
  /// Fluorescent tubes before a white reflector.
  void tubes() const {
    const int light = lit(12, 25);
    const float h = height();
    grid(size.x > 4.f ? 2 : 1, size.z > 4.f ? 2 : 1, [&](float x, float z) {
      room.box({x - 0.09f, h - 0.035f, z - 0.65f}, {x + 0.09f, h - 0.001f, z + 0.65f}, shade);
      for (const float side : {-0.045f, 0.045f})
        room.quad({x + side - 0.013f, h - 0.05f, z - 0.6f}, {x + side + 0.013f, h - 0.05f, z - 0.6f},
                  {x + side + 0.013f, h - 0.05f, z + 0.6f}, {x + side - 0.013f, h - 0.05f, z + 0.6f}, shade, light);
    });
  }
  /// A globe or a paper lantern on a cable.
  void globe(const glm::vec2& over) const {
    Random& r = room.random();
    const bool paper = r.chance(0.4f);
    const float radius = paper ? r.between(0.2f, 0.3f) : r.between(0.1f, 0.18f), y = height() - r.between(0.4f, 0.8f);
    room.rod({over.x, y + radius, over.y}, {over.x, height(), over.y}, 0.012f, metal);
    room.sphere({over.x, y, over.y}, radius, shade, 10, paper ? lit(3, 6) : lit(8, 16));
  }
  /// Pendants in a row, light below; of sheet metal, or a drum of cloth.
  void pendants(const glm::vec2& over) const {
    Random& r = room.random();
    const bool drum = r.chance(0.35f);
    const int count = drum ? 1 : r.whole(1, 3), light = drum ? lit(4, 8) : lit(7, 15);
    const float y = height() - r.between(0.6f, 1.0f), wide = drum ? r.between(0.2f, 0.32f) : r.between(0.1f, 0.2f);
    const float tall = drum ? r.between(0.18f, 0.3f) : wide * r.between(0.8f, 1.6f);
    for (int i = 0; i < count; ++i) {
      const float x = over.x + 0.45f * (static_cast<float>(i) - 0.5f * static_cast<float>(count - 1));
      Shapes s = room.at({x, y, over.y});
      s.rod({0, tall, 0}, {0, height() - y, 0}, 0.01f, metal);
      if (drum) {
        s.lathe({0, 0, 0}, {{wide, 0}, {wide, tall}}, shade, 28, light, true);
        s.disc({0, tall * 0.5f, 0}, wide * 0.98f, shade, 28);
        continue;
      }
      s.lathe({0, 0, 0}, {{wide, 0}, {wide * 0.7f, tall * 0.5f}, {wide * 0.25f, tall}, {0, tall * 1.02f}}, metal, 24,
              -1, true);
      s.disc({0, 0.01f, 0}, wide * 0.97f, shade, 24, light);
    }
  }
  /// Let into the ceiling.
  void downlights() const {
    const int light = lit(15, 35);
    const float h = height();
    grid(std::max(2, static_cast<int>(size.x / 1.3f)), std::max(2, static_cast<int>(size.z / 1.4f)),
         [&](float x, float z) {
           room.lathe({x, h - 0.014f, z}, {{0.055f, 0}, {0.06f, 0.013f}}, metal, 14);
           room.disc({x, h - 0.0145f, z}, 0.05f, shade, 14, light);
         });
  }
  /// Spots on a rail, each turned its own way.
  void rail() const {
    Random& r = room.random();
    const int count = r.whole(3, 5), light = lit(20, 45);
    const float h = height(), length = std::min(size.x * 0.6f, 2.4f), z = r.between(-0.2f, 0.2f) * size.z;
    room.box({-length / 2, h - 0.03f, z - 0.017f}, {length / 2, h - 0.001f, z + 0.017f}, metal);
    for (int i = 0; i < count; ++i) {
      const float x = length * ((static_cast<float>(i) + 0.5f) / static_cast<float>(count) - 0.5f);
      const float lean = r.between(-0.6f, 0.6f), c = std::cos(lean), s = std::sin(lean);
      room.rod({x, h - 0.03f, z}, {x, h - 0.1f, z}, 0.012f, metal);
      Shapes spot = room.at(glm::mat4(glm::vec4(c, s, 0, 0), glm::vec4(-s, c, 0, 0), glm::vec4(0, 0, 1, 0),
                                      glm::vec4(x, h - 0.1f, z, 1)));
      spot.lathe({0, -0.11f, 0}, {{0.04f, 0}, {0.038f, 0.1f}, {0.02f, 0.12f}}, metal, 16, -1, true);
      spot.disc({0, -0.1f, 0}, 0.038f, shade, 16, light);
    }
  }
  void chandelier(const glm::vec2& over) const {
    Random& r = room.random();
    const int arms = r.whole(3, 6), light = lit(8, 18);
    const float y = height() - r.between(0.55f, 0.8f), reach = r.between(0.2f, 0.36f);
    Shapes s = room.at({over.x, y, over.y});
    s.lathe({0, -0.06f, 0}, {{0.01f, 0}, {0.04f, 0.04f}, {0.02f, 0.1f}, {0.012f, height() - y + 0.06f}}, metal, 12);
    for (int i = 0; i < arms; ++i) {
      const float a = 6.2832f * static_cast<float>(i) / static_cast<float>(arms);
      const glm::vec3 out(std::cos(a), 0, std::sin(a));
      s.tube({{0, 0, 0},
              out * (reach * 0.5f) + glm::vec3(0, -0.06f, 0),
              out * reach,
              out * reach + glm::vec3(0, 0.06f, 0)},
             0.008f, metal, 6);
      s.sphere(out * reach + glm::vec3(0, 0.1f, 0), 0.045f, shade, 6, light);
    }
  }
  /// Strips along two walls, lighting the ceiling from behind a board.
  void cove() const {
    const int light = lit(6, 14);
    const float h = height(), x = size.x / 2, z = size.z / 2;
    for (const float side : {-1.f, 1.f}) {
      const float at = side * (z - 0.14f);
      room.box({-x, h - 0.16f, std::min(side * z, at)}, {x, h - 0.13f, std::max(side * z, at)}, shade);
      room.box({-x, h - 0.13f, at - 0.006f}, {x, h - 0.09f, at + 0.006f}, shade);
      const float z0 = side * (z - 0.04f), z1 = side * (z - 0.07f);
      room.quad({-x, h - 0.125f, std::max(z0, z1)}, {x, h - 0.125f, std::max(z0, z1)},
                {x, h - 0.125f, std::min(z0, z1)}, {-x, h - 0.125f, std::min(z0, z1)}, shade, light);
    }
  }
  /// A bare bulb on its cable.
  void bulb(const glm::vec2& over) const {
    Random& r = room.random();
    const float radius = r.between(0.03f, 0.06f), y = height() - r.between(0.15f, 0.9f);
    room.tube({{over.x, y + radius, over.y}, {over.x, height(), over.y}}, 0.004f, metal, 6);
    room.cylinder({over.x, y + radius * 0.8f, over.y}, 0.018f, 0.05f, metal, 10);
    room.sphere({over.x, y, over.y}, radius, shade, 8, lit(40, 120));
  }
  /// A ring that glows, hanging.
  void ring(const glm::vec2& over) const {
    Random& r = room.random();
    const float radius = r.between(0.2f, 0.45f), thick = r.between(0.02f, 0.05f), y = height() - r.between(0.3f, 0.8f);
    for (const float side : {-1.f, 1.f})
      room.tube({{over.x + side * radius, y, over.y}, {over.x, height() - 0.003f, over.y}}, 0.002f, metal, 5);
    room.torus({over.x, y, over.y}, radius, thick, shade, 28, lit(10, 25));
  }
  /// A luminous ceiling: one wide panel.
  void skylight() const {
    Random& r = room.random();
    const float w = size.x * r.between(0.15f, 0.35f), d = size.z * r.between(0.15f, 0.35f), h = height() - 0.004f;
    room.quad({-w, h, -d}, {w, h, -d}, {w, h, d}, {-w, h, d}, shade, lit(1.5f, 4));
  }
  /// A flush drum or dome.
  void flush(const glm::vec2& over) const {
    Random& r = room.random();
    const float radius = r.between(0.16f, 0.28f), x = over.x * 0.5f, z = over.y * 0.5f;
    if (r.chance(0.5f))
      room.lathe({x, height() - 0.1f, z}, {{radius, 0}, {radius, 0.09f}}, shade, 28, lit(4, 9));
    else
      room.lathe({x, height() - 0.11f, z}, {{0, 0}, {radius * 0.5f, 0.015f}, {radius * 0.85f, 0.05f}, {radius, 0.1f}},
                 shade, 28, lit(4, 9));
  }
};

/// A shade around a bulb: open above and below, or a globe.
void shade_on(Shapes& s, float low, float top, float wide, float narrow, int shade, int light) {
  s.lathe({0, low, 0}, {{wide, 0}, {narrow, top - low}}, shade, 20, light, true);
}

void desk_lamp(Shapes& s, const Kit& kit, float height, int light) {
  const int metal = s.material(kit.palette->chrome()), shade = s.material(kit.palette->diffuser());
  s.cylinder({0, 0, 0}, 0.08f, 0.02f, metal, 18);
  const glm::vec3 elbow(-0.12f, height * 0.65f, 0), head(0.1f, height, 0);
  s.tube({{0, 0.02f, 0}, elbow, head}, 0.008f, metal, 6);
  Shapes hood = s.at(head - glm::vec3(0, 0.08f, 0));
  hood.lathe({0, 0, 0}, {{0.075f, 0}, {0.06f, 0.05f}, {0.02f, 0.09f}, {0, 0.095f}}, metal, 18, -1, true);
  hood.disc({0, 0.012f, 0}, 0.07f, shade, 18, light);
}

}  // namespace

glm::vec3 lamp_color(Random& random, const Palette& palette) {
  const glm::vec3 warm(1.5f, 0.93f, 0.45f), cold(0.9f, 1.0f, 1.2f);
  const float t = random.unit();
  glm::vec3 c = warm + (cold - warm) * t;
  if (palette.is_varied() && random.chance(kColouredLamps))
    for (int k = 0; k < 3; ++k) c[k] *= random.log_between(0.2f, 1);
  return c / (0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z);
}

void build_ceiling_lamps(Shapes& room, const glm::vec3& size, Palette& palette, const ShellStyle& style,
                         const glm::vec2& over) {
  Random& r = room.random();
  const int metal = room.material(palette.metal()), shade = room.material(palette.diffuser());
  const Ceiling lamps{room, size, metal, shade, lamp_color(r, palette) * style.lamp_power, style.lamps_on};
  if (palette.is_varied() && r.chance(0.3f)) {
    switch (r.whole(0, 2)) {
      case 0:
        return lamps.bulb(over);
      case 1:
        return lamps.ring(over);
      default:
        return lamps.skylight();
    }
  }
  switch (r.whole(0, 10)) {
    case 0:
      return lamps.panels();
    case 1:
      return lamps.tubes();
    case 2:
      return lamps.downlights();
    case 3:
      return lamps.rail();
    case 4:
      return lamps.cove();
    case 5:
      return lamps.chandelier(over);
    case 6:
    case 7:
      return lamps.pendants(over);
    case 8:
      return lamps.globe(over);
    default:
      return lamps.flush(over);
  }
}

void table_lamp(Shapes& s, const Kit& kit, float height) {
  Random& r = s.random();
  const bool lit = r.chance(kit.lamp_on);
  const int light = lit ? s.emitter({lamp_color(r, *kit.palette) * r.between(3.f, 9.f) * kit.lamp_power, false}) : -1;
  const float kind = r.unit();
  if (kind < 0.3f) return desk_lamp(s, kit, height, light);
  const int foot = s.material(r.chance(0.5f) ? kit.palette->trinket() : kit.palette->metal());
  const int shade = s.material(kit.palette->diffuser());
  if (kind < 0.5f) {
    const float radius = height * 0.3f;
    s.lathe({0, 0, 0}, {{radius * 0.8f, 0}, {radius * 0.7f, 0.02f}, {0.012f, 0.03f}, {0.012f, height - 2 * radius}},
            foot, 16);
    s.sphere({0, height - radius, 0}, radius, shade, 8, light);
    return;
  }
  const float belly = r.between(0.03f, 0.08f);
  s.lathe({0, 0, 0}, {{0.06f, 0}, {0.065f, 0.01f}, {belly * 0.7f, 0.04f}, {belly, 0.12f}, {0.015f, height * 0.55f}},
          foot, 16);
  const float wide = r.between(0.1f, 0.16f);
  shade_on(s, height * 0.55f, height, wide, wide * r.between(0.5f, 1.f), shade, light);
}

Piece floor_lamp(const Kit& kit, Random& random) {
  const float h = random.between(1.35f, 1.8f), r = random.between(0.14f, 0.22f);
  const Material metal = random.chance(0.6f) ? kit.palette->chrome() : kit.palette->wood(),
                 shade = kit.palette->diffuser();
  const bool lit = random.chance(kit.lamp_on + 0.15f);
  const int style = random.whole(0, 3);
  const glm::vec3 radiance = lamp_color(random, *kit.palette) * random.between(4.f, 10.f) * kit.lamp_power;
  return {"floor_lamp", {2 * r + 0.04f, h, 2 * r + 0.04f}, [=](Shapes& s) {
            const int m = s.material(metal), c = s.material(shade);
            const int light = lit ? s.emitter({radiance * (style == 2 ? 2.f : 1.f), false}) : -1;
            if (style == 1) {  // three legs
              for (int i = 0; i < 3; ++i) {
                const float a = 2.0944f * static_cast<float>(i);
                s.tube({{r * std::cos(a), 0, r * std::sin(a)}, {0.02f * std::cos(a), h - 0.28f, 0.02f * std::sin(a)}},
                       0.013f, m, 8);
              }
            } else {
              s.lathe({0, 0, 0}, {{r * 0.8f, 0}, {r * 0.8f, 0.02f}, {0.012f, 0.03f}, {0.012f, h - 0.1f}}, m, 20);
            }
            if (style == 2) {  // a bowl that lights the ceiling
              s.lathe({0, h - 0.12f, 0}, {{0.02f, 0}, {r * 0.7f, 0.05f}, {r, 0.12f}}, m, 24, -1, true);
              s.lathe({0, h - 0.02f, 0}, {{r * 0.9f, 0}, {0, 0.01f}}, c, 24, light, true);
              return;
            }
            if (style == 3) return s.sphere({0, h - 0.12f, 0}, std::min(r, 0.17f), c, 10, light);
            shade_on(s, h - 0.28f, h, r, r * 0.8f, c, light);
          }};
}

void wall_lamp(Shapes& s, const Kit& kit) {
  Random& r = s.random();
  const int metal = s.material(kit.palette->chrome()), shade = s.material(kit.palette->diffuser());
  const int light = r.chance(kit.lamp_on)
                        ? s.emitter({lamp_color(r, *kit.palette) * r.between(4.f, 10.f) * kit.lamp_power, false})
                        : -1;
  s.box({-0.04f, -0.06f, 0}, {0.04f, 0.06f, 0.02f}, metal);
  s.tube({{0, 0, 0.02f}, {0, -0.02f, 0.09f}, {0, 0.02f, 0.11f}}, 0.008f, metal, 6);
  Shapes at = s.at({0, 0, 0.11f});
  if (r.chance(0.4f)) return at.sphere({0, 0.08f, 0}, 0.07f, shade, 8, light);
  shade_on(at, 0.02f, 0.16f, 0.08f, 0.055f, shade, light);
}

}  // namespace clerestory
