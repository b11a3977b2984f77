// A picture as cameras hand it out. Rooms are traced in clean linear radiance; people's photographs are clipped,
// tinted, bent by a tone curve, noisy, a little soft and dark in the corners. Nets that have not seen that trust it to
// be shape.
#pragma once
#include <cstdint>

#include "host/io/image.hpp"

namespace clerestory {

/// `linear`, 3 channels of any exposure, through a camera drawn from `key` and back to what the nets are given: linear
/// by the 2.2 that photographs are read with, the 95th percentile of luminance at 0.9. In order: vignetting, focus (a
/// Gaussian), exposure (its 90th to 99.9th percentile of luminance at white), white balance, shot and read noise,
/// clipping, a tone curve, the eight bits of a JPEG.
Image as_photographed(const Image& linear, std::uint64_t key);

}  // namespace clerestory
