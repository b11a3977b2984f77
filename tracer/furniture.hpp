// Furniture and the things that stand on it. A piece is drawn (size, materials, variant) before it is built, so that
// the room can find a place for it first.
#pragma once
#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "tracer/palette.hpp"
#include "tracer/shapes.hpp"

namespace clerestory {

/// What pieces are made from.
struct Kit {
  Palette* palette = nullptr;
  const std::vector<Model>* models = nullptr;  // may be empty
  float lamp_power = 1;                        // times the usual radiance of lamps
  float lamp_on = 0.6f;                        // probability that a small lamp is lit
};

/// Local frame: origin in the middle of the footprint on the floor, the front looks along +z.
struct Piece {
  std::string name;
  glm::vec3 size{0};  // x, y, z
  std::function<void(Shapes&)> build;
};

// Seating and beds.
Piece chair(const Kit& kit, Random& random);
Piece stool(const Kit& kit, Random& random);
Piece office_chair(const Kit& kit, Random& random);
Piece pouffe(const Kit& kit, Random& random);
Piece bench(const Kit& kit, Random& random);
/// width: 0.8 makes an armchair.
Piece sofa(const Kit& kit, Random& random, float width);
Piece bed(const Kit& kit, Random& random);

// Tables. Their size includes what stands around them.
Piece dining_table(const Kit& kit, Random& random);
Piece coffee_table(const Kit& kit, Random& random);
Piece desk(const Kit& kit, Random& random);
Piece side_table(const Kit& kit, Random& random);

// Storage.
Piece bookshelf(const Kit& kit, Random& random);
Piece cabinet(const Kit& kit, Random& random);
/// `height`: of the room; some reach up to the ceiling.
Piece wardrobe(const Kit& kit, Random& random, float height);
Piece metal_rack(const Kit& kit, Random& random);
Piece fridge(const Kit& kit, Random& random);
Piece fireplace(const Kit& kit, Random& random, float height);
Piece kitchen_row(const Kit& kit, Random& random, float width);
Piece tv_stand(const Kit& kit, Random& random);
Piece box_stack(const Kit& kit, Random& random);

// Bathrooms.
Piece washstand(const Kit& kit, Random& random);
Piece toilet(const Kit& kit, Random& random);
Piece bathtub(const Kit& kit, Random& random);
Piece washing_machine(const Kit& kit, Random& random);

// Smaller things on the floor.
Piece plant(const Kit& kit, Random& random);
Piece floor_lamp(const Kit& kit, Random& random);
Piece ball(const Kit& kit, Random& random);
Piece pedestal(const Kit& kit, Random& random, const Model& model);
Piece basket(const Kit& kit, Random& random);
Piece bag(const Kit& kit, Random& random);
Piece shoes(const Kit& kit, Random& random);
Piece toys(const Kit& kit, Random& random);
Piece papers(const Kit& kit, Random& random);
Piece floor_cushion(const Kit& kit, Random& random);
Piece speaker(const Kit& kit, Random& random);
/// Leans against the wall behind it.
Piece leaning_picture(const Kit& kit, Random& random);
/// One to three solids of any shape and pose.
Piece solids(const Kit& kit, Random& random);
Piece cartons(const Kit& kit, Random& random);
Piece garment(const Kit& kit, Random& random);
Piece cable(const Kit& kit, Random& random);
Piece packages(const Kit& kit, Random& random);
/// Clothes on a rail.
Piece clothes_rack(const Kit& kit, Random& random);
/// An upright panel on feet.
Piece screen(const Kit& kit, Random& random);
/// From the floor to the ceiling.
Piece column(const Kit& kit, Random& random, float height);
/// One of the things that lie or stand about.
Piece floor_clutter(const Kit& kit, Random& random);

/// Things on a horizontal top: `shapes` has its origin in the middle of the top, which measures width x depth.
/// `head_room`: height above it that is free.
void clutter(Shapes& shapes, const Kit& kit, float width, float depth, float head_room, int count);
/// A solid of any shape and pose, `most` metres long at most, resting on y = 0.
void random_solid(Shapes& shapes, const Kit& kit, float most, float room);
/// A bottle, box or bag with something printed on it.
void package(Shapes& shapes, const Kit& kit, float room);
/// A box with prints on its front, back and top; its lower side has its middle at the origin.
void printed_box(Shapes& shapes, const Kit& kit, const glm::vec3& size);
/// A row of books, their spines looking along +z, standing on y = 0 from x = 0 to `width`.
void books(Shapes& shapes, const Kit& kit, float width, float height, float depth);
/// A lamp for tables; origin at its foot.
void table_lamp(Shapes& shapes, const Kit& kit, float height);
/// A lamp on a wall; origin on the wall, z away from it.
void wall_lamp(Shapes& shapes, const Kit& kit);
/// A plant's leaves and pot, `height` in all.
void potted_plant(Shapes& shapes, const Kit& kit, float pot, float height);
/// A tap over a basin, origin at its foot, spout towards +z.
void tap(Shapes& shapes, float height, float reach, int metal);

/// Light of lamps, warm to cold white, a few of a varied palette's coloured; luminance 1.
glm::vec3 lamp_color(Random& random, const Palette& palette);

}  // namespace clerestory
