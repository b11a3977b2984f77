#include "nets/light_inputs.hpp"

namespace clerestory {

LightInputs light_inputs(Graph& graph, int n, int height, int width) {
  const auto map = [&](const char* name, int channels) { return graph.input(name, {n, channels, height, width}); };
  return {map("image", 3),
          map("depth", 1),
          {map("albedo", 3), map("normal", 3), map("material", 3)},
          graph.input("camera", {n, 4, 1, 1}),
          graph.input("range", {n, 3, 1, 1})};
}

}  // namespace clerestory
