// What the path tracer is given: triangles with materials, emitters, one panorama. World space, metres, y up.
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace clerestory {

/// Families of procedural textures; kernels/trace/texture.clh evaluates them.
enum class Texture { Plain, Plaster, Wood, Tiles, Fabric, Stone, Metal, Leather, Rug, Painting, Print };

/// A textured GGX + metallic material. The texture yields two weights in [0, 1]: `b` mixes a -> b, then `c` mixes the
/// result -> c, for colour, roughness and metallic alike, so looks and roughness go together; what smudges and stains
/// add does not. The kernel reads it as 32 floats in this order.
struct Material {
  float texture = 0;  // a Texture
  glm::vec3 color_a{0.5f}, color_b{0.5f}, color_c{0.5f};
  float roughness_a = 0.5f, roughness_b = 0.5f, roughness_c = 0.5f;
  float metallic_a = 0, metallic_b = 0, metallic_c = 0;
  glm::vec3 scale{1};      // cells or cycles per metre of u, v, w
  float gap = 0;           // width of grout or of the gap between planks, as a share of a cell
  float tint = 0;          // how much a cell's brightness differs from its neighbour's
  float warp = 0;          // how far noise bends the pattern, in cells
  float noise = 0;         // strength of the fine noise
  float seed = 0;          // shifts every noise lattice; whole numbers in [0, 4096)
  float wear = 0;          // share of the surface that dirt or scratches roughen, 0..1
  float pattern = 0;       // variant within the family, a whole number
  float uncapped = 0;      // 1: albedo as given; 0: capped, see kernels/trace/texture.clh
  float smudge = 0;        // how far roughness varies in clouds that the colour does not show
  float smudge_scale = 0;  // their size: cells per metre
  float stain = 0;         // how far brightness varies in clouds that the roughness does not show
  float stain_scale = 0;
  float unused = 0;
};
static_assert(sizeof(Material) == 32 * sizeof(float));

/// Light sent out by the front of the triangles that name it: a constant, or what the panorama shows behind it times
/// `radiance` (a window pane).
struct Emitter {
  glm::vec3 radiance{0};
  bool panorama = false;
};

/// uvw are texture coordinates in metres. `normal` is used where the triangle is smooth.
struct Vertex {
  glm::vec3 position{0}, uvw{0}, normal{0};
};

/// Front: the side from which v[0], v[1], v[2] run counter-clockwise.
struct Triangle {
  Vertex v[3];
  int material = 0;
  int emitter = -1;  // none
  bool smooth = false;
};

/// Equirectangular radiance, centre column along -z, right quarter +x, top row +y. RGB, row-major, no negative values.
struct Panorama {
  int width = 0, height = 0;
  std::vector<float> rgb;
};

struct World {
  std::vector<Triangle> triangles;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  Panorama panorama;        // may be empty when no emitter shows it
  float panorama_turn = 0;  // radians by which the panorama is turned about y
};

}  // namespace clerestory
