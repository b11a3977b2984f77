// How different two pictures look to somebody who flips between them: FLIP (Andersson et al. 2020, "FLIP: a difference
// evaluator for alternating images", PACM CGIT 3(2)), for pictures of low dynamic range.
#pragma once
#include "host/io/image.hpp"

namespace clerestory {

/// Of a picture of 3840 pixels and 0.7 m across, seen from 0.7 m.
inline constexpr double kFlipPixelsPerDegree = 67.0206;

/// A map of one channel in [0, 1], 0: no difference is seen. Both pictures have 3 channels of linear Rec.709 and one
/// size; values are clamped to [0, 1], which is what a display shows of them. Throws Error (Failed) for unlike
/// pictures.
Image flip(const Image& reference, const Image& test, double pixels_per_degree = kFlipPixelsPerDegree);

}  // namespace clerestory
