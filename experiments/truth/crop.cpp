#include "experiments/truth/crop.hpp"

#include <algorithm>

namespace clerestory {

Crop crop_to(const Camera& camera, const std::vector<bool>& pixels) {
  int low_x = camera.width, low_y = camera.height, high_x = -1, high_y = -1;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (!pixels[static_cast<std::size_t>(y) * camera.width + x]) continue;
      low_x = std::min(low_x, x), high_x = std::max(high_x, x), low_y = std::min(low_y, y),
      high_y = std::max(high_y, y);
    }
  Crop crop{camera, low_x, low_y};
  crop.camera.width = high_x - low_x + 1, crop.camera.height = high_y - low_y + 1;
  crop.camera.cx -= low_x, crop.camera.cy -= low_y;
  return crop;
}

void paste(const Image& part, const Crop& crop, const std::vector<bool>& pixels, Image& to) {
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < part.height; ++y)
      for (int x = 0; x < part.width; ++x)
        if (pixels[static_cast<std::size_t>(crop.y + y) * to.width + crop.x + x])
          to.at(c, crop.y + y, crop.x + x) = part.at(c, y, x);
}

}  // namespace clerestory
