// A photograph with objects put into it (kernels/shade/insertion.cl). Detached.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Of one picture, {1, C, h, w}.
struct InsertionPictures {
  Value photo;    // 3
  Value objects;  // 3: radiance of objects times their share of a pixel
  Value covers;   // 1: that share
  Value change;   // 3: by the objects, of the rest of a pixel, as the layer has it
  Value without;  // 3: the layer's picture of the room without them; 0: not asked
  Value emits;    // 1: 1 where the room emits
};

/// objects + (1 - covers) max(photo + gain change, 0), the gain being the photograph over the layer where the change is
/// plain, 1 where it is faint, and at most 1 where light is added. {1, 3, h, w}.
Value insertion(const InsertionPictures& pictures);

/// Share of the photograph below which a change is faint: there insertion() does not read `without`.
inline constexpr float kFaintChange = 1.0f / 128;

}  // namespace clerestory
