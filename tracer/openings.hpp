// What fills the openings of walls, in the wall's own coordinates.
#pragma once
#include "tracer/room_shell.hpp"

namespace clerestory {

/// Width of the frame around doors and passages.
inline constexpr float kCasing = 0.07f;

/// Materials by number: of the wall, frames, fittings, panes; `light`: the emitter that panes are.
void window(Shapes& s, const Opening& o, int wall, int frame, int metal, int pane, int light);
void door(Shapes& s, const Opening& o, int wall, int frame, int leaf, int metal, int pane);
/// The frame around a door or a passage.
void casing(Shapes& s, const Opening& o, int frame);
/// The sides of a recess, and the board that a niche begins with.
void recess_sides(Shapes& s, const Opening& o, int wall);

/// Beside and before a window.
void curtains(Shapes& s, const Opening& o, float height, const Kit& kit);
void blind(Shapes& s, const Opening& o, const Kit& kit);
void radiator(Shapes& s, const Opening& o, int material);

}  // namespace clerestory
