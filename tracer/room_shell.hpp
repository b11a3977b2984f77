// Walls with openings and recesses, windows, doors, what hangs on walls: what a room has before furniture.
#pragma once
#include <string>
#include <vector>

#include "tracer/room.hpp"

namespace clerestory {

/// A hole in a wall, in the wall's own coordinates: x along it from -length / 2, y up, z into the room.
struct Opening {
  /// Bay: a part of the room beyond the wall, so that its floor is an L or a T. Niche: shelves or a seat let into the
  /// wall. Passage: a corridor that ends at a door.
  enum Kind { Door, Window, Bay, Niche, Passage };
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  Kind kind = Door;
  float depth = 0;  // of a recess
  bool is_recess() const { return kind >= Bay; }
};

struct Wall {
  glm::mat4 to_room{1};
  float length = 0, height = 0;
  Opening::Kind behind = Opening::Door;  // the recess whose back it is; Door: a wall of the room itself
  std::vector<Opening> openings{};
  /// Stretches taken by what stands or hangs there: x0, x1 and up to which height.
  struct Taken {
    float x0, x1, height;
  };
  std::vector<Taken> taken{};
  bool is_free(float x0, float x1, float above) const;
  bool takes_furniture() const { return behind == Opening::Door || behind == Opening::Bay; }
};

/// Four walls around a floor of the given size, each looking inwards: along +z, +x, -z, -x.
std::vector<Wall> make_walls(const glm::vec3& size);

/// What the shell is made of and lit by.
struct ShellStyle {
  float lamp_power = 1;
  bool lamps_on = true;
  float daylight = 1;  // factor of the panorama; 0: panes are dark
  bool tiled_walls = false;
};

/// Picks doors, recesses and windows (at least one window when `windowed`) on walls longer than a metre. The backs of
/// recesses are added to the walls.
void choose_openings(std::vector<Wall>& walls, float height, bool windowed, bool recesses, Random& random);
/// Floors of the room and of its recesses: the first is the room's own.
std::vector<Floor> floors_of(const std::vector<Wall>& walls, const glm::vec3& size);
/// Builds floors, ceilings, walls, reveals, frames, panes, doors, skirting.
void build_shell(Shapes& room, std::vector<Wall>& walls, const std::vector<Floor>& floors, Palette& palette,
                 const ShellStyle& style);
/// Shelves, books, seats in the niches, a lamp in the passages.
void furnish_recesses(Shapes& room, const std::vector<Wall>& walls, const Kit& kit);
/// Ceiling lamps; `over` is where a pendant hangs (a table's middle). At least one is lit when style.lamps_on.
void build_ceiling_lamps(Shapes& room, const glm::vec3& size, Palette& palette, const ShellStyle& style,
                         const glm::vec2& over);
/// Pictures, mirrors, shelves and lamps where walls are free, curtains and blinds at windows, radiators under them,
/// switches and sockets.
void decorate_walls(Shapes& room, std::vector<Wall>& walls, const Kit& kit);

}  // namespace clerestory
