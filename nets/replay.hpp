// One sample of one pixel taken again, with every quantity on its way.
#pragma once
#include <string>
#include <vector>

#include "nets/render_scene.hpp"

namespace clerestory {

/// A quantity of a sample: a number, a vector or a colour; no numbers where there is none, as of a ray that nobody
/// traced.
struct Quantity {
  std::string name;
  std::vector<double> values;
};

/// What render_scene() does for `sample` of the pixel y * width + x, by the same kernels in `precision`, with
/// settings.spp, settings.seed and settings.sharing as there. In this order: maps at the pixel, random numbers, frame,
/// view and wi (local), direction, alpha, probability of the lobe, pdf, weight, the pixel that is hit (its column and
/// row), delta, u, radiance in view (of a light with u: as if u were 0), out of view (u = 1) and of lamps, what is
/// mixed of them, contribution to the pixel. Learned light is asked with its states in that precision. Throws
/// usage_error: a pixel or sample that the re-render does not have.
std::vector<Quantity> replay(Device& device, const Scene& scene, const RenderSettings& settings, int pixel, int sample,
                             Precision precision);

}  // namespace clerestory
