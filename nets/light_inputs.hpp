// Pictures as the light's nets read them.
#pragma once
#include "host/ops/shade/sample_brdf.hpp"

namespace clerestory {

/// A batch of pictures as the light reads them; all {n, C, h, w} but camera {n, 4, 1, 1} and range {n, 3, 1, 1}.
struct LightInputs {
  Value image;  // linear radiance, 95th percentile of luminance 0.9
  Value depth;  // axial metres, 0 none
  Surfaces surfaces;
  Value camera, range;
};

/// They as inputs of a graph: "image", "depth", "albedo", "normal", "material", "camera", "range".
LightInputs light_inputs(Graph& graph, int pictures, int height, int width);

}  // namespace clerestory
