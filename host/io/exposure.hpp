// The unit in which a photograph is looked at.
#pragma once
#include "host/io/image.hpp"

namespace clerestory {

/// The factor under which a photograph, and all that is compared with it, is shown and judged: what brings the 95th
/// percentile of its luminance to 0.9, or 1 where that is within a factor of four: a picture made for a screen stays as
/// it is.
double shown_exposure(const Image& photo);

}  // namespace clerestory
