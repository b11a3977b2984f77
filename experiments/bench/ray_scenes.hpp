// Depth maps with normals that rays are timed on, of any size.
#pragma once
#include <string>

#include "host/graph/tensor.hpp"
#include "host/math/camera.hpp"

namespace clerestory {

struct RayScene {
  std::string name;
  Camera camera;
  Tensor depth, normal;  // {1, 1, h, w} metres, 0 none; {1, 3, h, w} camera frame, unit, towards the viewer
};

/// "room": the furnished box room of bench_room(). "office": the depth that was measured of assets/real/office, with
/// the normals of its own points and holes where nothing was measured, each pixel taken from the nearest that there is.
/// "noise": depths without any order, between 2 and 3 m, and normals likewise, about the direction to the viewer.
/// Throws usage_error for another name, or where the office's files are missing.
RayScene ray_scene(const std::string& name, int width, int height);

}  // namespace clerestory
