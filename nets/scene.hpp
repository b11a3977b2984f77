// The scene of one picture: maps, camera and the photograph. Behind invert, insert, edit, light and evaluate.
#pragma once
#include <string>
#include <vector>

#include "host/io/image.hpp"
#include "host/math/camera.hpp"

namespace clerestory {

struct RoomView;  // host/io/datasets.hpp

/// All images have the photograph's size and unit. Frames: architecture of the README (camera space, axial metres).
struct Scene {
  Camera camera;
  Image photo;     // 3: linear radiance
  Image albedo;    // 3: [0, 1]
  Image normal;    // 3: camera space, unit
  Image depth;     // 1: axial metres, 0 none
  Image material;  // 3: roughness, metallic, emission flag

  int width() const { return camera.width; }
  int height() const { return camera.height; }
  /// 99th percentile of valid depth, metres: the unit of uncertainty and thickness.
  double scale() const;
  /// Throws usage_error naming `where` when a map is missing or of another size than the camera's.
  void check(const std::string& where) const;
};

/// A generated view as a scene; its emission makes the flags. Throws usage_error naming `where` when the view has no
/// camera or no emission.
Scene scene_of(const RoomView& view, const std::string& where);

/// 1 where the photograph is saturated as a lamp or window would be: all channels at least 0.98 in a 4-connected region
/// of more than 0.02 % of the picture; {1 channel}.
Image emission_flags(const Image& photo);
/// The same of linear radiance, which has no white to saturate at: where luminance is ten times its 95th percentile.
Image lamp_flags(const Image& radiance);

/// Share of pixels whose flag (channel 2 of material) is set.
double emitting_share(const Image& material);

}  // namespace clerestory
