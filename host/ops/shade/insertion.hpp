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

/// 0 where a change is so faint beside the photograph that insertion() takes it as it is, to 1: the largest of three
/// channels, {1, 1, h, w}.
Value plainness(Value change, Value photo);

}  // namespace clerestory
