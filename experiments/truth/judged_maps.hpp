// A scene's maps as they are judged: true ones prepared as those of files are, predicted ones relative to their scale.
#pragma once
#include "experiments/evaluation/prepare.hpp"
#include "nets/scene.hpp"

namespace clerestory {

/// True maps and the photograph at another size of the same proportions, or at their own. Emitting pixels are those
/// that the scene's flags say.
PreparedView prepare_scene(const Scene& scene, int width, int height);

/// Depth over its 99th percentile, which goes to `scale`, metres.
MapSet relative_maps(const Scene& scene, double* scale);

}  // namespace clerestory
