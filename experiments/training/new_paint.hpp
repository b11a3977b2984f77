// Rooms painted anew. Tracing shows a net each room in one set of colours; what it learns by heart of these, it says of
// others' rooms. Metal sends back its albedo times light, what is rough and no metal its albedo and a veil of 0.05
// without colour: so a picture can be given other paint without being traced again, anew each time it is seen.
#pragma once
#include <cstdint>

#include "experiments/evaluation/prepare.hpp"

namespace clerestory {

/// `view` with other paint on some of its parts, drawn from `key`, and its exposure taken again. A part: the pixels
/// that are most like one of a few in place, normal, albedo and roughness. Its albedo a is multiplied or replaced, by
/// one colour or by a pattern of two that is solid in space and fades into its mean where pixels are too wide for it;
/// the picture is multiplied by (a' + v) / (a + v), v = 0.05 (1 - metallic). Left as they are: what emits, what is
/// unknown, and dielectrics below a roughness of 0.25 (by degrees up to 0.5), whose highlights have no albedo. Light
/// that goes from one surface to another keeps its old colour. Albedo stays within [0.02, 0.78], of metal 0.92, or what
/// it was. Without a camera nothing is done.
void paint_anew(PreparedView& view, std::uint64_t key);

}  // namespace clerestory
