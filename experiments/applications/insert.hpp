// `clerestory insert`: balls and meshes put into a photograph, lit by it, shadowing it and mirrored in it.
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/applications/light_choice.hpp"
#include "nets/rounds.hpp"
#include "tracer/trace_objects.hpp"

namespace clerestory {

/// One object. Exactly one place (`at` or `at_point`) and one shape (`radius` or `mesh` with `size`).
struct InsertedObject {
  std::optional<std::array<double, 2>> at;        // pixel on whose surface it rests
  std::optional<std::array<double, 3>> at_point;  // camera metres: a ball's centre, a mesh's lowest point
  std::optional<double> radius;                   // metres
  std::filesystem::path mesh;                     // .glb
  std::optional<double> size;                     // metres: longest side of the mesh's box
  std::array<double, 3> albedo{0.9, 0.9, 0.9};
  double roughness = 0.1, metallic = 1;
};

struct InsertOptions {
  std::filesystem::path run, out;  // out empty: the run folder
  std::filesystem::path json;      // that the caller will write, and so no result; may be empty
  bool force = false;              // replace files of others
  std::vector<InsertedObject> objects;
  RenderSettings render;
  std::optional<RenderGoal> goal;  // rounds of render.spp samples and more, in place of so many
  LightChoice lit_by;
  int bounces = 2;  // scatterings at objects that are followed
  std::string device, gemm = "auto";
  std::vector<std::string> command;
};

/// Writes composite.exr, composite.png and insert.json.
void insert(const InsertOptions& options);

/// Column and row of the pixel that lies at a position.
std::pair<int, int> pixel_of(const std::array<double, 2>& at);

/// Surface at a pixel's centre: point and normal, as the maps have them, in camera space. Throws usage_error naming
/// --at: outside of the picture, no depth, no normal.
std::pair<Vec3, Vec3> surface_at(const Scene& scene, const std::array<double, 2>& at);

/// Meshes in camera space. Balls `at` a pixel touch the surface that rays meet there (surface_plane.hpp). Throws
/// usage_error: a pixel outside or without depth, a point behind the camera, an object larger than the room.
std::vector<PlacedMesh> place_objects(const Scene& scene, const std::vector<InsertedObject>& objects);

/// What the camera sees with the objects in place: the scene's maps with object pixels replaced, and which those are.
struct SceneWithObjects {
  Scene scene;
  Image shows;  // 1: 1 where an object is seen
};
SceneWithObjects put_before(Device& device, const Scene& scene, TraceObjects& objects,
                            const std::vector<InsertedObject>& list);

/// The scene with objects under the light of `settings`.
struct Insertion {
  Image covers;        // 1: the share of a pixel that objects cover
  Image composite;     // 3: photograph changed as the layer is by the objects; their share shows what they reflect
  double seconds = 0;  // of rendering, after the plans were made
  double dropped = 0;  // samples that were not finite: a bias, said
  std::vector<RenderRound> rounds = {};  // of insert_until()
};
/// `passes` over the picture share settings.spp samples, at least two each, and look through different points of its
/// pixels, so that objects have smooth edges; one pass looks through their middles.
Insertion insert_into(Device& device, const Scene& scene, const std::vector<InsertedObject>& objects,
                      const RenderSettings& settings, int bounces, int passes = 1);
/// In rounds, the first of settings.spp samples; pixels that show an object, in part or whole, are judged, and all
/// where none does. Passes as `clerestory insert` has them. Throws what check_goal() throws.
Insertion insert_until(Device& device, const Scene& scene, const std::vector<InsertedObject>& objects,
                       const RenderSettings& settings, int bounces, const RenderGoal& goal);

}  // namespace clerestory
