// The solids that rooms are made of: what a room file holds (tracer/room_file.hpp), and the triangles that they become.
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "host/io/mesh_file.hpp"
#include "tracer/scene.hpp"

namespace clerestory {

/// In room files by number: new kinds come last, and what a kind becomes never changes.
enum class PartKind : std::uint8_t {
  Quad,
  Canvas,
  Box,
  Cushion,
  Lathe,
  Disc,
  Sphere,
  Mesh,
  Curtain,
  Tube,
  Turned,
  Blob,
  Cloth
};

/// One solid, in coordinates of its own. `numbers`, metres:
///   Quad     four corners counter-clockwise seen from the front; u, v at the first one
///   Canvas   four corners
///   Box      low and high corner
///   Cushion  low and high corner, radius of the edges; `steps` along an edge's quarter turn
///   Lathe    base; radius and height of each ring, lowest first; `steps` around
///   Disc     centre, radius; `steps` around
///   Sphere   centre, radius; `steps` from pole to pole
///   Mesh     foot, height; `model`
///   Curtain  low corner, width, height, depth of a fold; `steps` folds
///   Tube     radius, two points or more that its axis runs through; `steps` around
///   Turned   as Lathe, but smooth from ring to ring; rings may end where they begin (a torus, `open`)
///   Blob     centre, three radii, depth and waves of its bumps, number of its noise; `steps` from pole to pole
///   Cloth    middle of its foot, width, depth, height, number of its noise: a crumpled sheet; `steps` along a side
struct Part {
  PartKind kind = PartKind::Box;
  std::vector<float> numbers;
  int steps = 0;
  int material = 0, emitter = -1;
  bool open = false;  // a lathe, or what is turned, without discs at its ends
  std::string model{};
  glm::mat4 to_room{1};  // affine
  glm::vec3 shift{0};    // of texture coordinates
};

/// Adds the triangles of a part to `world`. `mesh`: that of part.model, for PartKind::Mesh.
void add_part(World& world, const Part& part, const Mesh* mesh = nullptr);

}  // namespace clerestory
