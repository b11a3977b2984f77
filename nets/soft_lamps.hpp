// Light that a photograph does not show, found by what it does to the surfaces that it shows.
#pragma once
#include <array>
#include <vector>

#include "host/math/vec.hpp"

namespace clerestory {

class Device;
struct Scene;
struct SceneLight;
struct RenderSettings;
class Graph;

/// A Gaussian blob of radiance, seen where no visible surface answers (host/ops/light/soft_lamps.hpp).
struct SoftLamp {
  Vec3 place{0};                     // camera metres
  double size = 1;                   // metres
  std::array<double, 3> radiance{};  // at its middle, the photograph's unit
};

/// `light` and the lamps. It traces, for lamps shine only where a ray leaves what is seen.
SceneLight with_lamps(Graph& graph, SceneLight light, const std::vector<SoftLamp>& lamps);

/// What a fit to the photograph weighs (of lamps, of the constant light). Those of lamps were chosen on rooms on which
/// nothing is judged (docs/results/lamps.md): more floor lights diffuse surfaces better, the ridge matters little.
struct FitWeights {
  double floor = 2;  // of the mean of what is seen, added to what an error is relative to; relative errors alone
                     // (0) end too dark
  double ridge = 1;  // of lamps: of the mean of the squared columns; shading tells little of where a lamp stands, so
                     // that light is spread over all candidates that explain it alike
};

/// What multiplies a pixel's error in a fit to the photograph: 1 / (seen + floor times the mean of all that count).
double weight_of_pixel(double seen, double mean, const FitWeights& fit);

/// Lamps that explain what the photograph's surfaces send beyond what settings.light makes them send, and how well.
struct LampFit {
  std::vector<SoftLamp> lamps;      // none: the light is bright enough everywhere
  double before = 0, after = 0;     // root mean square error of the re-render, weighted by weight_of_pixel()
  std::array<double, 3> missing{};  // share of the photograph that the light alone does not explain, by channel
  std::size_t candidates = 0;
  double seconds = 0;
};

/// A coarse grid of the photograph's pixels is rendered again under settings.light with settings.nets; what is missing
/// is a sum of candidates' shares, blobs around the camera wherever the picture does not look, and their radiances are
/// the non-negative least squares solution (Lawson and Hanson 1974), by coordinate descent. Directions are drawn as
/// `settings` says, and surfaces are its surface model. Pixels that emit or are
/// clipped do not count. settings.lamps are not read. Throws what scene_light() throws.
LampFit fit_lamps(Device& device, const Scene& scene, const RenderSettings& settings);

}  // namespace clerestory
