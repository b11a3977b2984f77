// Batches for the light: rays with known radiance, and a coarse grid of pixels to be rendered again. Everything is a
// function of (seed, position), as for the maps (batches.hpp).
#pragma once
#include "experiments/training/light_views.hpp"
#include "nets/light_training.hpp"

namespace clerestory {

struct LightSampling {
  double clipped = 0.5;     // share of views whose picture the nets see clamped to [0, 1], as a photograph is
  double probe_rows = 0.2;  // share of a view's points that are free probes, where it has any
  bool flip = true;
  double exposure_low = 0.85, exposure_high = 0.95;  // 95th percentile of luminance
  bool ldr = false;                                  // picture and light are clamped to [0, 1]
};

/// Inputs of light_training() by name, but for learning_rate and step.
struct LightBatch {
  std::map<std::string, Tensor> feeds;
  std::vector<std::string> views;  // for messages
  std::uint32_t draws = 0;         // seed of what the graph itself draws
};

/// Rays of one view: `rows` points, from each `samples` directions; ray i is sample i % samples of point i / samples.
struct LightRays {
  std::vector<Vec3> points, directions;     // camera metres; unit, away from the point
  std::vector<std::array<float, 3>> light;  // radiance that arrives, the image's unit
  std::vector<int> skip;                    // pixel that a ray starts from, or -1
};
/// Points are pixels of environment-map tiles that have depth, and probes. Directions are texels: of a tile all
/// different, of a probe drawn by solid angle. `key` keys all choices. samples <= 128.
LightRays draw_rays(const LightView& view, int rows, int samples, double probe_rows, std::uint64_t key);

/// "points", "directions" {1, 3, rows, samples} and "skip" {1, 1, rows, samples} as the light's graphs take them.
std::map<std::string, Tensor> ray_tensors(const LightRays& rays, int samples);

/// Steps between the pixels that are rendered again, along both sides of a view of that size; 0 where the grid does not
/// divide it.
int shade_stride(const LightTrainingOptions& options, int width, int height);

/// Views side by side; `keys` key what is drawn for each: rays, mirroring, exposure, clipping, the coarse grid's place.
/// Throws usage_error when the coarse grid does not divide the view evenly.
LightBatch light_batch(const std::vector<std::shared_ptr<const LightView>>& views, const LightTrainingOptions& options,
                       const LightSampling& sampling, const std::vector<std::uint64_t>& keys);

}  // namespace clerestory
