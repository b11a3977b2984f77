// Materials replaced in generated rooms with true maps by `edit`, beside the tracer's pictures of the rooms with those
// materials: errors on the pixels that are edited and on all others.
#pragma once
#include <string>
#include <vector>

#include "experiments/applications/edit.hpp"
#include "host/io/config.hpp"
#include "tracer/room.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// Keys of its own.
void add_edit_keys(Schema& schema);

/// study.kind = "edit". Returns the run directory.
std::string run_edit_study(const Config& config, const std::vector<std::string>& command);

/// One case: which surface, and what it becomes.
enum class EditedSurface { Floor, Wall, Furniture };
struct EditCase {
  std::string key, name;
  EditedSurface surface;
  MaterialEdit change;  // all values set
};
const std::vector<EditCase>& edit_cases();

/// The material that shows most pixels of such a surface in a view; -1 where all show less than a share of `least`.
/// Floor: level and at y = 0. Wall: upright on the room's border. Furniture: all else below the ceiling.
int material_of_surface(const Room& room, const Camera& camera, const TraceMaps& maps, EditedSurface surface,
                        double least);

/// The room with a material replaced by a plain one of these values, and the pixels (1) that show it and do not emit.
World with_material(const World& world, int material, const MaterialEdit& change);
Image mask_of_material(const World& world, const TraceMaps& maps, int material);

}  // namespace clerestory
