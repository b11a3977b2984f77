// What a photograph shows where a material is replaced (kernels/shade/repaint.cl). Detached.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Materials of one picture before and after, {1, C, h, w}.
struct Repainted {
  Value old_albedo, old_material, albedo, material;  // 3
  Value emitted;                                     // 1: 1 where the surface was an emitter before
};

/// The layer's pictures of it, {1, 3, h, w}.
struct RepaintLayers {
  Value old_specular, specular;  // the specular part before and after
  Value whole;                   // both parts, after
};

/// What pixels where `shown` {1, 1, h, w} is not 0 show less `photo`, 0 elsewhere: {1, 3, h, w}. Specular parts are the
/// layer's; the diffuse part is the photograph's own, times the ratio of diffuse albedos as far as that is trusted.
Value repaint(Value photo, const Repainted& materials, Value shown, const RepaintLayers& layers);

/// {1, 1, h, w}: 0 where repaint() does not read RepaintLayers::whole.
Value repaint_layer_share(const Repainted& materials);

}  // namespace clerestory
