// Both parts of the light of a picture, asked along any rays (Zhu et al. 2022, section 4): training, validation and
// inference share this.
#pragma once
#include <optional>

#include "host/ops/light/ssrt.hpp"
#include "nets/in_view.hpp"
#include "nets/li2020_light.hpp"
#include "nets/out_of_view.hpp"

namespace clerestory {

/// What a light is made of: both parts, or in their place what the rival has.
struct LightSizes {
  InViewSize in_view;
  OutOfViewSize out_of_view;
  DeltaDepth delta = DeltaDepth::Linear;       // of the u by which both are mixed (Eq. 6), in training and ever after
  std::optional<Li2020LightSize> li2020 = {};  // the light's net of Li et al., which answers alone
};
/// "paper" or "compact"; throws usage_error otherwise.
LightSizes light_sizes(const std::string& preset);

/// Floating-point operations of the products that one ray takes of each part.
double in_view_flops(const InViewSize& size);
double out_of_view_flops(const OutOfViewSize& size);  // 0 for shells, which look light up

/// One picture, with what its nets say once.
struct LitPicture {
  Value image;
  SsrtScene scene;
  Value camera, range;
  LightPixels pixels;
  LightField field;
  Gaussians lobes;  // of Li et al.: in camera space, of each cell of their grid
};

/// States are named "local.*" and "global.*".
std::vector<LitPicture> lit_pictures(Graph& graph, const LightInputs& pictures, const LightSizes& sizes, bool training);

/// Radiance {1, 3, rows, samples} along rays. Under the net of Li et al. all three are its one answer.
struct LightAnswer {
  Value mixed, in_view, out_of_view;  // Eq. 6 and its parts; in_view means nothing on a miss
  SsrtHits hits;
};
/// points, directions {1, 3, rows, samples}: camera metres, unit; skip Int {1, 1, ...}: the pixel that a ray does not
/// hit, or -1.
/// Light of Li et al. is that of the pixel that a ray's point is seen at, wherever the point lies.
LightAnswer ask_light(Graph& graph, const LitPicture& picture, const LightSizes& sizes, Value points, Value directions,
                      Value skip);

}  // namespace clerestory
