// Classes of material. In each, colour, roughness and metallic go together as they do in homes, so that the one can be
// learned from the looks of the other; within a class they vary from object to object and over the texture.
#pragma once
#include <glm/glm.hpp>
#include <vector>

#include "tracer/random.hpp"
#include "tracer/scene.hpp"

namespace clerestory {

enum class MaterialClass {
  WallPaint,   // matt emulsion, roughness 0.75-0.98; now and then satin or
               // polished plaster
  GlossPaint,  // lacquered wood, doors, cabinets, 0.1-0.6
  Wood,        // oiled or varnished, 0.15-0.8, dark gaps rough
  Tile,        // glazed, 0.08-0.3, with rough grout
  Stone,       // polished marble or honed granite, 0.1-0.5
  Fabric,      // 0.85-1
  Leather,     // 0.35-0.6, creases rougher
  Plastic,     // 0.25-0.55
  Ceramic,     // glazed, 0.08-0.2
  Metal,       // brushed or polished, 0.1-0.45, metallic
  Carpet,      // 0.95-1
  Paper,       // 0.75-0.95
  Concrete,    // 0.7-0.95
};

/// Draws materials. One palette serves one room, so that its pieces match: a few woods, fabrics and metals.
class Palette {
 public:
  /// `stone_only`: the texture family Stone takes the place of every hard surface it can (held-out rooms);
  /// `no_stone`: it never appears (training rooms).
  Palette(Random random, bool stone_only, bool no_stone);

  /// A fresh material of the class. Where Stone is barred, tiles or concrete take its place.
  Material make(MaterialClass kind);
  /// One of the room's own few woods, fabrics or metals.
  Material wood();
  Material fabric();
  Material metal();
  /// What furniture bodies are made of in this room: wood, gloss paint or plastic; stone in held-out rooms.
  Material body();
  /// Hard table tops.
  Material top();

  Material floor();
  Material wall();
  /// Stripes, dots, leaves and clouds, printed on paper.
  Material wallpaper();
  Material ceiling();
  Material rug();
  Material painting();
  Material mirror();
  /// Taps, rails, legs: polished metal without colour, or a dark one.
  Material chrome();
  /// Cloth with something woven or printed on it.
  Material print();
  /// A leaf of a plant.
  Material leaf();
  /// White goods, sanitary ware.
  Material enamel();
  /// Screens and panes: black glass.
  Material glass();
  /// A lamp's diffuser.
  Material diffuser();
  /// Thin colourful things: books, boxes, vases, mugs.
  Material trinket();

 private:
  glm::vec3 paint_color();
  glm::vec3 strong_color();
  Material made_wood();
  Material brick();
  Material planks(const Material& wood);

  Random random_;
  bool stone_only_, no_stone_;
  std::vector<Material> woods_, fabrics_, metals_;
  float body_choice_ = 0;
};

/// The name that configs and tests use.
const char* name_of(MaterialClass kind);

}  // namespace clerestory
