// Walls with openings, windows, doors, ceiling lamps: what a room has before furniture.
#pragma once
#include <string>
#include <vector>

#include "tracer/room.hpp"

namespace clerestory {

/// A hole in a wall, in the wall's own coordinates: x along it from -length / 2, y up, z into the room.
struct Opening {
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool window = false;
};

struct Wall {
  glm::mat4 to_room{1};
  float length = 0;
  std::vector<Opening> openings;
  /// Stretches taken by what stands or hangs there: x0, x1 and up to which height.
  struct Taken {
    float x0, x1, height;
  };
  std::vector<Taken> taken;
  bool is_free(float x0, float x1, float above) const;
};

/// Four walls around a floor of the given size, each looking inwards: along +z, +x, -z, -x.
std::vector<Wall> make_walls(const glm::vec3& size);

/// What the shell is made of and lit by.
struct ShellStyle {
  float lamp_power = 1;
  bool lamps_on = true;
  float daylight = 1;  // factor of the panorama; 0: panes are dark
};

/// Picks doors and windows (at least one window when `windowed`) on walls longer than a metre.
void choose_openings(std::vector<Wall>& walls, float height, bool windowed, Random& random);
/// Builds floor, ceiling, walls, reveals, frames, panes, doors, skirting.
void build_shell(Shapes& room, std::vector<Wall>& walls, const glm::vec3& size, Palette& palette,
                 const ShellStyle& style);
/// Ceiling lamps; `over` is where a pendant hangs (a table's middle). At least one is lit when style.lamps_on.
void build_ceiling_lamps(Shapes& room, const glm::vec3& size, Palette& palette, const ShellStyle& style,
                         const glm::vec2& over);
/// Pictures, mirrors, shelves and clocks where walls are free, curtains beside windows, radiators under them.
void decorate_walls(Shapes& room, std::vector<Wall>& walls, float height, const Kit& kit);

}  // namespace clerestory
