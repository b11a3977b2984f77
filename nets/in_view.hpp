// LightNet's in-view part (Zhu et al. 2022, section 4.2): what a visible surface point sends along a ray, from features
// of the photograph at the pixel that the ray hits.
#pragma once
#include <string>

#include "host/ops/light/select_rays.hpp"
#include "host/ops/shade/sample_brdf.hpp"
#include "nets/builder.hpp"
#include "nets/resnet.hpp"

namespace clerestory {

/// How the last layer's number f becomes radiance. Released: min(relu(f), 100), as the released code has it. Exp:
/// exp(f - 5) (Mildenhall et al. 2022). Residual: I(hit) exp(f), whose zero is the photograph.
enum class LightOutput { Released, Softplus, Exp, Residual };
LightOutput light_output_of(const std::string& name);  // released | softplus | exp | residual; throws usage_error

struct InViewSize {
  ResnetSize trunk{.stages = 3};
  int frequencies = 64;                                   // of each encoding: twice as many numbers
  double direction_deviation = 2, surface_deviation = 1;  // of the frequencies, cycles per unit
  int width = 512, layers = 9;                            // hidden layers of the MLP
  int again = 5;  // the layer, counted from 0, that is given the whole input once more; 0: none
  LightOutput output = LightOutput::Residual;
  bool log_input = true;  // a trunk without imagenet_input reads ln(1 + photograph): windows are hundreds of times
                          // brighter than walls
};
/// Numbers into which a ray's direction and the surface that it hits are encoded.
int encoded_numbers(const InViewSize& size);
/// "paper" or "compact"; throws usage_error otherwise.
InViewSize in_view_size(const std::string& preset);

/// What the MLP's first layer, and the layer that is given the input again, owe to the hit pixel: linear, so computed
/// once per pixel and gathered, exactly. Channels: the first layer's, then the other's. In training
/// rays are fewer than pixels: there surfaces are encoded, and multiplied by their weights, where rays hit.
struct LightPixels {
  Value features;      // {1, width or 2 width, h/2, w/2}
  Value surface = {};  // {1, width or 2 width, h, w}; not in training
  Value numbers = {};  // {1, 10, h, w}, in training alone: what is encoded of surfaces
};

/// `image` {1, 3, h, w}: linear radiance, 95th percentile of luminance 0.9, not clamped. Diffuse A (1 - M) and specular
/// lerp(0.04, A, M) colours, normals and roughness are encoded by random Fourier features (Tancik et al. 2020), whose
/// frequencies are states that are not trained.
LightPixels light_pixels(const Scope& scope, Value image, const Surfaces& surfaces, const InViewSize& size);
/// The same for a batch {n, ...}, by picture: the trunk sees all of them at once.
std::vector<LightPixels> light_pixels_of_batch(const Scope& scope, Value image, const Surfaces& surfaces,
                                               const InViewSize& size);

/// Radiance {1, 3, rows, samples} that comes along `direction` (unit, camera frame, from the point towards the surface)
/// from `hit` (SsrtHits::pixel). What a miss gets means nothing. photo {1, 3, H, W}: the picture whose pixels `hit`
/// counts, of whatever size; its radiance is read by Residual alone.
Value in_view_light(const Scope& scope, const LightPixels& pixels, Value hit, Value direction, Value photo,
                    const InViewSize& size);

/// The MLP at inference, for one picture: what its layers owe to each pixel, and with `normal` its answers along the
/// directions of a grid around each pixel's normal (host/ops/light/direction_grid.hpp), from which rays are then
/// answered. No gradient.
struct InViewAnswers {
  Value rows;               // pixel_rows(pixels.surface, pixels.features); no value: nobody answers
  Shape picture{};          // of pixels.surface
  Value grid, normal = {};  // {1, 3, h w, side^2} of `normal` {1, 3, h, w}; no values: each ray asks the MLP
};
inline constexpr int kGridSide = 4;
InViewAnswers in_view_answers(const Scope& scope, const LightPixels& pixels, const InViewSize& size, Value normal = {});

/// in_view_light() for inference: one kernel, and only for the rays that `list` holds; what others get means nothing.
Value ask_in_view_light(const Scope& scope, const InViewAnswers& answers, Value hit, Value direction, Value photo,
                        const RayList& list, const InViewSize& size);

/// Item i of a batch {n, C, h, w}: {1, C, h, w}, a view. Where gradients come back it is better to take all at once:
/// theirs are then written side by side, not each into a batch of zeros.
Value item_of(Value batch, int i);
std::vector<Value> items_of(Value batch);

}  // namespace clerestory
