// The part of a picture that holds some pixels: what is traced of a room that differs nowhere else.
#pragma once
#include <vector>

#include "host/io/image.hpp"
#include "host/math/camera.hpp"

namespace clerestory {

struct Crop {
  Camera camera;  // of the part
  int x = 0, y = 0;
};
/// The smallest that holds all `pixels` of a camera's picture, of which there is one at least.
Crop crop_to(const Camera& camera, const std::vector<bool>& pixels);

/// The crop's picture into the whole one, where `pixels` is set.
void paste(const Image& part, const Crop& crop, const std::vector<bool>& pixels, Image& to);

}  // namespace clerestory
