// Normals and depth without a net: the photograph's room is an empty box whose edges lie on edges of the picture. A
// simple rival of learned geometry, which reads the picture and its camera alone.
#pragma once
#include <array>

#include "host/io/image.hpp"
#include "host/math/camera.hpp"

namespace clerestory {

/// A box around the camera. Distances in heights of the camera above the floor.
struct RoomBox {
  Mat3 axes{1};  // the room's, as columns in camera space: right, up, backwards
  std::array<double, 3> plus{2, 0.8, 1},
      minus{2, 1, 2.5};  // to the walls that these point at, and to the opposite ones
};

/// What a camera sees of an empty box.
struct BoxMaps {
  Image normal, depth;    // of camera space, towards the camera; axial, in heights of the camera above the floor
  std::vector<int> face;  // 0 to 5: plus right, minus right, plus up (the ceiling), ...
};
BoxMaps maps_of(const RoomBox& box, const Camera& camera);

/// The box of which the edges that are seen lie on edges of the picture (linear, clamped to [1/255, 1]) that run the
/// same way, among boxes of the sizes that rooms have.
RoomBox fitted_box(const Image& picture, const Camera& camera);

}  // namespace clerestory
