// Solids made of triangles, placed by a transform.
#pragma once
#include <glm/glm.hpp>
#include <vector>

#include "tracer/parts.hpp"
#include "tracer/random.hpp"

namespace clerestory {

/// A glTF model that may stand about.
struct Model {
  std::string name;
  Mesh mesh;
};

/// Adds shapes to a scene. Coordinates are local to the object (x right, y up, z towards its front, origin on the
/// floor) and taken to the room by the transform given. Texture coordinates are local metres with u along the longest
/// side of a part, shifted at random, so that no two boards have the same grain.
class Shapes {
 public:
  /// `record`: also gets every part, in order.
  Shapes(World& scene, const glm::mat4& to_room, Random random, std::vector<Part>* record = nullptr);
  /// The same scene under a further transform.
  Shapes at(const glm::mat4& local);
  Shapes at(const glm::vec3& offset, float turn_about_y = 0);

  int material(const Material& material);
  int emitter(const Emitter& emitter);

  /// Corners counter-clockwise seen from the front; uv in metres along its two sides, `uv` at the first corner.
  void quad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, int material,
            int emitter = -1, const glm::vec2& uv = glm::vec2(0));
  /// The same with u and v from -1 to 1: rugs and pictures.
  void canvas(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, int material);
  void box(const glm::vec3& low, const glm::vec3& high, int material);
  /// A board of the given size whose lower side has its middle at `base`.
  void block(const glm::vec3& base, const glm::vec3& size, int material);
  /// A box with rounded edges and smooth normals: cushions, mattresses, moulded plastic.
  void cushion(const glm::vec3& low, const glm::vec3& high, float radius, int material, int steps = 3);
  /// A round body about the vertical through `base`: radii at heights, lowest first; smooth around, flat along where
  /// `faceted`, closed by discs where the first or last radius is positive.
  void lathe(const glm::vec3& base, const std::vector<glm::vec2>& radius_height, int material, int sides = 20,
             int emitter = -1, bool open = false);
  void cylinder(const glm::vec3& base, float radius, float height, int material, int sides = 20);
  /// A flat disc that looks down: lamps.
  void disc(const glm::vec3& center, float radius, int material, int sides = 20, int emitter = -1);
  /// A rod of square section between two points.
  void rod(const glm::vec3& from, const glm::vec3& to, float thickness, int material);
  /// `steps` rings; 24 make normals true to 1e-3 of the radius.
  void sphere(const glm::vec3& center, float radius, int material, int steps = 12, int emitter = -1);
  /// A model scaled to `height`, standing on `base`.
  void mesh(const Model& model, const glm::vec3& base, float height, int material);
  /// A hanging sheet with folds across x, between two corners: curtains.
  void curtain(const glm::vec3& low, float width, float height, float fold, int folds, int material);

  /// A round rod through points: handles, taps, legs, cables.
  void tube(const std::vector<glm::vec3>& points, float radius, int material, int sides = 8);

  /// As lathe(), smooth from ring to ring too.
  void turned(const glm::vec3& base, const std::vector<glm::vec2>& radius_height, int material, int sides = 20,
              int emitter = -1, bool open = false);
  /// A ring of round section that lies flat, its middle at `center`.
  void torus(const glm::vec3& center, float radius, float thickness, int material, int sides = 24, int emitter = -1);
  /// An ellipsoid with dents of up to `depth` of its radii.
  void blob(const glm::vec3& center, const glm::vec3& radii, float depth, float waves, int material, int steps = 14);
  /// A crumpled sheet that lies on `foot`.
  void cloth(const glm::vec3& foot, const glm::vec3& size, int material, int steps = 22);

  Random& random() { return random_; }

 private:
  void rings(PartKind kind, const glm::vec3& base, const std::vector<glm::vec2>& profile, int material, int sides,
             int emitter, bool open);
  /// Under the own transform.
  void add(Part part, const Mesh* mesh = nullptr);

  World* scene_;
  std::vector<Part>* record_;
  glm::mat4 to_room_;
  Random random_;
};

}  // namespace clerestory
