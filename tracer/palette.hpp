// Classes of material. In each, colour, roughness and metallic go together as they do in homes; within a class they
// vary from object to object and over the texture. What training shows varies further: how glossy, worn and stained a
// thing is cannot be told from its kind alone, and in some rooms any surface may look and shine in any way (Tobin et
// al. 2017, "Domain randomization": what a net has seen vary it learns to see through).
#pragma once
#include <glm/glm.hpp>
#include <initializer_list>
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

/// What a palette draws from.
enum class Content {
  Plain,    // the classes as they are, without stone: bare boxes
  Varied,   // and further prints, finishes, smudges and stains: training rooms
  Wild,     // and most surfaces of any texture, colour, roughness and metallic: a share of training rooms
  HeldOut,  // the classes as they are, stone in the place of every hard surface it can take
};

/// Draws materials. One palette serves one room, so that its pieces match: a few woods, fabrics and metals.
class Palette {
 public:
  Palette(Random random, Content content);
  bool is_varied() const { return content_ == Content::Varied || content_ == Content::Wild; }
  bool is_wild() const { return content_ == Content::Wild; }

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
  /// What is printed on packages, covers and posters.
  Material label();
  /// Brown packing board.
  Material cardboard();
  /// Any texture, colour, roughness and metallic.
  Material anything();
  /// Thin colourful things: books, boxes, vases, mugs.
  Material trinket();

 private:
  bool stone_only() const { return content_ == Content::HeldOut; }
  /// The class as it is.
  Material made(MaterialClass kind);
  Material made_wall_paint();
  Material made_gloss_paint();
  Material made_wood();
  Material made_tile();
  Material made_stone();
  Material made_fabric();
  Material made_leather();
  Material made_plastic();
  Material made_ceramic();
  Material made_metal();
  Material made_carpet();
  Material made_paper();
  Material made_concrete();
  /// Another look of the class, where the draw says so and it has one.
  bool further(MaterialClass kind, Material& m);
  /// How glossy, worn and stained this one is.
  Material lived_with(Material m, MaterialClass kind);
  void cloud(Material& m, float smudged, float stained);
  /// In wild rooms most often anything else.
  Material dressed(const Material& m);
  /// One of these patterns of Texture::Print, in repeats a metre; its roughness is the caller's.
  Material patterned(std::initializer_list<int> patterns, float least, float most);
  Material any_texture();
  glm::vec3 any_color();
  glm::vec3 paint_color();
  glm::vec3 strong_color();
  Material vinyl();
  Material brick();
  Material planks(const Material& wood);

  Random random_;
  Content content_;
  std::vector<Material> woods_, fabrics_, metals_;
  float body_choice_ = 0;
};

/// The name that configs and tests use.
const char* name_of(MaterialClass kind);

}  // namespace clerestory
