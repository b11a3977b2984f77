// `clerestory edit`: the material under a mask replaced in a photograph, and the light that follows from it.
//
// Under `light = image` a ray that ends on a surface finds the photograph's radiance there. After an edit the edited
// pixels send other light, and so does whatever they light. Bounce 1 is what the edited surface itself reflects;
// bounce k adds, at every pixel of the edited scene, what its rays bring of the change that bounce k - 1 made:
//   C_0 = photograph,  C_k = C_(k-1) + D_k,  D_k = render of the edited scene lit by D_(k-1) alone.
// The layer is linear in its light and all bounces have equal seeds, so that C_k off the mask is the photograph +
// (render lit by C_(k-1) - render lit by the photograph), without the second render, and exactly the photograph where
// no ray meets a change.
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/applications/light_choice.hpp"
#include "nets/rounds.hpp"

namespace clerestory {

/// The new material; what is not set stays as it is. At least one is set.
struct MaterialEdit {
  std::optional<std::array<double, 3>> albedo;  // linear, [0, 1]
  std::optional<double> roughness, metallic;    // [0, 1]
};

struct EditOptions {
  std::filesystem::path run, mask, out;  // out empty: RUN/edit
  bool force = false;                    // give up what `out` holds besides the files of an edit
  MaterialEdit change;
  RenderSettings render;
  std::optional<RenderGoal> goal;  // rounds of render.spp samples and more, in place of so many
  LightChoice lit_by;
  int bounces = 2;  // 1 to kMostEditBounces
  std::string device, gemm = "auto";
  std::vector<std::string> command;
};

inline constexpr int kMostEditBounces = 8;

/// Maps after the edit. A pixel is edited when it is under the mask, has a depth, and its material or flag changes: an
/// edited pixel no longer emits, a window pane under the mask becomes a surface that is lit.
struct EditedScene {
  Scene scene;                // its photograph is that of the scene before
  std::vector<bool> edited;   // row-major
  std::vector<bool> emitted;  // edited pixels that were flagged as emitters
  double share() const;       // of all pixels
};

/// Throws usage_error: nothing asked for, a value out of range, a mask (1 channel, 1 where edited) of another size or
/// empty.
EditedScene apply_edit(const Scene& scene, const Image& mask, const MaterialEdit& change);

/// What one bounce of light did.
struct EditBounce {
  double rays = 0, dropped = 0;  // traced; not finite
  double changed = 0;            // share of pixels that it changes at all
};

struct Edit {
  EditedScene with;
  Image composite;                  // 3: the photograph after the edit
  std::vector<EditBounce> bounces;  // those followed; fewer than asked for when one changes nothing
  double shown = 0;                 // share of pixels that are edited and face the viewer; others keep the photograph
  double seconds = 0;               // of rendering, after the plans were made
  std::vector<RenderRound> rounds;  // where there was a goal
};

/// The composite. Edited pixels are replaced, by both lobes apart. Specular: what the layer finds along the rays, since
/// the photograph knows nothing of what the new lobe looks at. Diffuse: the photograph less its old specular part,
/// times the ratio of diffuse albedos, since the photograph has measured the light that falls on the surface, from
/// lamps out of view too, which the layer only estimates. Beyond a ratio of 4 in one channel that light is taken from
/// all three as if it were grey; where all are too dark for that, and for pixels that emitted, the layer's estimate
/// takes over. A mirror is so the layer's, a repainted wall the photograph's, and an edit that changes little changes
/// the picture little (of metal, only as far as the layer finds what the photograph shows). `settings.light` lights the
/// edited surface in bounce 1; later bounces are carried by rays that end on a change. What an edited pixel throws on
/// others is the radiance that it sends to the camera: right for rough surfaces, a guess for mirrors. With a goal, in
/// rounds, the first of settings.spp samples: pixels that show a new material are judged, and all where none does.
Edit edit_scene(Device& device, const Scene& scene, const Image& mask, const MaterialEdit& change,
                const RenderSettings& settings, int bounces, const std::optional<RenderGoal>& goal = {});

/// Writes a folder, whole or not at all: composite.exr and composite.png, and the maps, camera and photo.exr (the
/// composite) of the edited scene, so that it is itself a run to be edited or inserted into; mask.png, provenance.json,
/// report.html. Returns a summary as JSON.
std::string edit(const EditOptions& options);

}  // namespace clerestory
