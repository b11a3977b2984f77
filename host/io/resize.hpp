// Pictures and maps at other sizes, as they enter the nets.
#pragma once
#include "host/io/image.hpp"

namespace clerestory {

/// Mean over the box that each new pixel covers (weights are areas), or the bilinear interpolation between pixel
/// centres along an axis that grows. Unchanged when the size is equal.
Image resize_area(const Image& image, int width, int height);
/// The bilinear interpolation between pixel centres, clamped at the border, whether an axis grows or shrinks: as
/// OpenCV's INTER_LINEAR does it, and PyTorch without align_corners.
Image resize_bilinear(const Image& image, int width, int height);
/// The pixel under each new pixel's centre: floor((x + .5) * w / width).
Image resize_nearest(const Image& image, int width, int height);

/// Size at which a picture enters the nets: the longer side becomes `longer`, the other follows, at least one pixel.
struct Size {
  int width = 0, height = 0;
  bool operator==(const Size&) const = default;
};
Size net_size(int width, int height, int longer);

}  // namespace clerestory
