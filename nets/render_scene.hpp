// The scene rendered again from its maps, camera and light by the Monte Carlo layer: no photograph goes in but through
// `light = image`.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/cl/device.hpp"
#include "host/graph/op.hpp"
#include "nets/savings.hpp"
#include "nets/scene.hpp"
#include "nets/soft_lamps.hpp"

namespace clerestory {

struct LightNets;  // nets/scene_light.hpp

/// Whether rays that meet one surface from nearly one way share an answer of the in-view MLP (learned_light).
enum class Sharing { WhereItPays, Never, Always };

/// Names as on the command line; render_scene() throws usage_error naming the setting on an unknown one.
struct RenderSettings {
  int spp = 64;
  // vndf_caps | vndf_hemisphere | vndf_bounded | ndf | cosine | uniform | grid8x16, or guided: vndf_caps and directions
  // drawn towards lamps (known_lamps); without one it is vndf_caps. Studies have ndf_roughness as well.
  std::string sampler = "vndf_caps";
  std::string points = "sobol";       // independent | sobol
  std::string ssrt = "hierarchical";  // dda | hierarchical
  std::string delta;                  // linear | window; empty: as the light's nets were trained, linear without nets
  double thickness = 0;               // metres behind a surface at which a ray passes unseen; 0: surfaces have no back
  std::string light = "image";        // one of light_names()
  std::shared_ptr<const LightNets> nets;          // of learned light
  std::optional<std::array<double, 3>> constant;  // radiance of `constant`; none: ambient_of() the scene
  std::optional<std::array<double, 3>> level;     // factors of `image`, `panorama` and `mirrored`, by channel; none: 1
  std::vector<SoftLamp> lamps;                    // added to any light (fit_lamps)
  FitWeights fit;                                 // of fit_lamps() and fit_level()
  std::string brdf = "ggx";                       // ggx | li2020
  std::uint32_t seed = 0;
  Sharing sharing = Sharing::WhereItPays;
  std::set<Saving> leave_out = all_savings();  // what this scene does not need
  Precision precision = Precision::Single;
  int chunk_rays = 0;    // rays at once; 0: as many as the light allows
  int every_chunk = 1;   // to take times: only every so manieth chunk of rays, and a picture that means nothing
  bool profile = false;  // fill Rendering::kernels
  ChunkListener after_chunk;
};

/// Where a sample was not finite; over rounds `sample` counts on.
struct DroppedSample {
  int x = 0, y = 0, sample = 0;
};

/// What the layer gives for every pixel, in the scene's own units, and what it counted.
struct Rendering {
  Image radiance, standard_error, uncertainty;  // 3, 3, 1 channels; the error is a bound under Sobol points
  double rays = 0;                              // traced
  double dropped = 0;                           // samples that were not finite: a bias, printed
  std::optional<DroppedSample> first_dropped;   // the first of them, to be replayed
  double facing_away = 0;                       // pixels not shaded because their normal faces away from the viewer
  double hits = 0;                              // rays that end on a visible surface
  /// Rays that each part of a learned light answered: "in view", "out of view".
  std::vector<std::pair<std::string, double>> answered;
  double shared_answers = 0;           // of the in-view MLP, if rays share them
  std::vector<KernelProfile> kernels;  // seconds by kernel, when asked for
  double seconds = 0;                  // of the run alone, after the plan was made
  std::string explanation;             // of the plan
};

Rendering render_scene(Device& device, const Scene& scene, const RenderSettings& settings);

/// Radiance of rays that leave the picture under `light = image`: the mean of the photograph's pixels that do not emit.
std::array<double, 3> ambient_of(const Scene& scene);
/// The same for a picture and its emission flags, one a pixel.
std::array<double, 3> ambient_of(const Image& photo, const float* emits);

}  // namespace clerestory
