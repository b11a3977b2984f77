// Rooms painted anew. Tracing shows a net each room in one set of colours; what it learns by heart of these, it says of
// others' rooms. Where a surface scatters, or is metal, the picture is its albedo times light: both are multiplied
// alike, part by part, by colours and patterns that are drawn anew each time a view is seen.
#pragma once
#include <cstdint>

#include "experiments/evaluation/prepare.hpp"

namespace clerestory {

/// `view` with other paint on some of its parts, drawn from `key`, and its exposure taken again. A part: the pixels
/// that are most like one of a few in place, normal, albedo and roughness. Its colour is multiplied, replaced, or
/// multiplied by a pattern that is solid in space, as wide as its pixels can show. Left as they are: what emits, what
/// is unknown, and dielectrics below a roughness of 0.25 (by degrees up to 0.5), whose highlights have no albedo. Light
/// that goes from one surface to another keeps its old colour. Albedo stays within [0.02, 0.95], or what it was.
/// Without a camera nothing is done.
void paint_anew(PreparedView& view, std::uint64_t key);

}  // namespace clerestory
