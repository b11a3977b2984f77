// One training step of the light as a graph (Zhu et al. 2022, section 5, Eq. 9): incident light along rays whose truth
// is known, and the picture rendered again.
#pragma once
#include "host/ops/nn/adam.hpp"
#include "nets/losses.hpp"
#include "nets/mixed_light.hpp"

namespace clerestory {

/// Weights of the terms; 0 leaves a term and all that it alone needs out.
struct LightLossWeights {
  double mixed = 1;        // both parts mixed by u (Eq. 6), on the rays that hit
  double out_of_view = 1;  // the out-of-view part alone, on all rays
  double rerender = 0.1;   // the picture rendered again, squared error
  double irradiance = 0;   // the mean of each row of rays, both parts mixed
  double unseen = 0;       // the out-of-view part, each ray weighed by its u: by what Eq. 6 takes of that part
};

/// How radiance is compared. Hdr: RawNeRF's loss, as in the paper; its optimum is the mean of what may be. Relative:
/// squared error of logarithms and, at a quarter, relative squared error, both with the floor of the measures (0.01);
/// the picture rendered again is then compared relatively, too. The light of Li et al. has losses of its own.
enum class RadianceLoss { Hdr, Relative };
RadianceLoss radiance_loss_of(const std::string& name);  // hdr | relative; throws usage_error

struct LightTrainingOptions {
  int batch = 4, height = 120, width = 160;
  int rows = 64, samples = 64;  // rays of a picture whose light is known: points x directions
  int shade_height = 24,
      shade_width = 32;  // pixels (0 under sizes.li2020: none) of a picture that are rendered again, on a coarser grid
  int shade_samples = 16;
  LightLossWeights weights{};
  RadianceLoss radiance = RadianceLoss::Hdr;
  AdamOptions adam{};
  double average = 0;  // as in MgnetTrainingOptions
};

/// Inputs, with b a picture of the batch:
///   "image", "albedo", "normal" {n,3,h,w}, "material" {n,3,h,w}, "depth" {n,1,h,w}, "camera" {n,4,1,1}, "range"
///   {n,3,1,1} "points<b>", "directions<b>", "light<b>" {1,3,rows,samples}: where rays start (camera metres), where
///   they go (unit),
///     the radiance that arrives (the image's unit); "skip<b>" Int {1,1,rows,samples}: the pixel that a ray starts
///     from, or -1
///   "known<b>" {1,1,rows,samples}: 1 where the light is known
///   and with weights.rerender > 0 the coarser grid: "shade_albedo", "shade_normal", "shade_material", "shade_depth",
///   "shade_camera", "shade_image" {n,3,...}, "shade_mask" {n,1,...} (0 where emitters are seen), and
///   "shade_skip<b>" Int {1,1,pixels,samples}
///   "learning_rate" and "step" {1,1,1,1} (1 for the first).
/// With sizes.li2020 the terms are theirs, and neither `radiance` nor the coarser grid is read:
///   mixed     10 <(ln(1 + s L') - ln(1 + L))^2> over known rays and channels, s the least-squares scale of each
///   picture rerender  <(clamp(diffuse + specular, 0, 1) - image)^2> over cells that do not emit, after
///   li2020_rescaled()
struct LightTraining {
  NamedValues losses;               // "loss" first
  std::vector<std::string> frozen;  // scopes that no term of a weight above zero sees: none of their parameters moves
  std::vector<Value> parameters;    // as in MgnetTraining
  Value squares;
};
LightTraining light_training(Graph& graph, const LightSizes& sizes, const LightTrainingOptions& options);

/// RawNeRF's loss of radiance (Mildenhall et al. 2022): <((y' - y) / (sg(y') + 0.001))^2>_m over mask and channels.
/// prediction and truth {1,3,rows,samples}, mask {1,1,...}.
Value hdr_loss(Value prediction, Value truth, Value mask);
/// <E ln(E / E') - E + E'> with E' and E the means of prediction and truth {1,3,rows,samples} over each row, each +
/// 0.01: the divergence of Poisson's distribution (Csiszar 1991), which has the mean for its optimum, where logarithms
/// and what is relative to the truth have less: light that is right ray by ray in those shades a surface too dark. Its
/// slope along ln E' is E' - E. That of a squared error relative to E' (RawNeRF's), whose optimum is the mean as well,
/// is 1 - E / E': where a lamp shines on what was dark so far that is thousands, and one such row outweighs a batch.
/// Rays of a tile are drawn evenly over angles of elevation and count alike, not by their cosine.
Value irradiance_loss(Value prediction, Value truth);
/// <ln((y' + e) / (y + e))^2>_m + <(y' - y)^2 / (y^2 + e)>_m / 4 with e = 0.01; y' at least 0.
Value relative_loss(Value prediction, Value truth, Value mask);

}  // namespace clerestory
