// The pinhole camera and the conventions of every image in the project.
//
// Camera space: x right, y up, the camera looks along -z, metres. Pixel (i, j), column and row, has its origin top left
// and its centre at (i + .5, j + .5). Depth is axial (-z), positive.
#pragma once
#include <array>
#include <optional>
#include <string>

#include "host/math/vec.hpp"

namespace clerestory {

struct Camera {
  int width = 0, height = 0;                                                               // pixels
  double fx = 0, fy = 0, cx = 0, cy = 0;                                                   // pixels
  std::array<double, 16> camera_to_world{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};  // row-major, metres

  /// Square pixels, principal point in the middle. `fov_degrees` is the full horizontal angle, 0 < fov < 180; without
  /// it the longer side spans 65 degrees. Throws usage_error (`--fov`, image size) on anything else.
  static Camera from_fov(int width, int height, std::optional<double> fov_degrees = std::nullopt);

  /// Throws usage_error naming `where` unless sizes and focal lengths are positive, all numbers are finite and
  /// camera_to_world is a rigid motion (to 1e-3, as files round).
  void check(const std::string& where) const;

  /// The same view on another pixel grid: all four intrinsics are scaled, each axis by its own factor.
  Camera resized(int new_width, int new_height) const;

  /// Full horizontal angle of view, degrees, of a camera whose principal point lies anywhere.
  double fov_degrees() const;

  /// Direction through image position (x, y), in pixels with fractions, with z = -1: depth times it is the point.
  Vec3 ray(double x, double y) const { return {(x - cx) / fx, -(y - cy) / fy, -1}; }
  /// The same, of length one.
  Vec3 direction(double x, double y) const;
  /// Point in camera space seen at (x, y) at axial `depth` in metres.
  Vec3 unproject(double x, double y, double depth) const { return depth * ray(x, y); }
  /// Image position of a point in camera space, whether inside the image or not; nothing where it is not before the
  /// camera (z >= 0).
  std::optional<Vec2> project(const Vec3& point) const;

  Mat3 rotation() const;  // camera to world
  Vec3 position() const;  // of the camera, in the world
  Vec3 to_world(const Vec3& point) const { return rotation() * point + position(); }
  Vec3 to_camera(const Vec3& point) const { return glm::transpose(rotation()) * (point - position()); }
  Vec3 direction_to_world(const Vec3& d) const { return rotation() * d; }
  Vec3 direction_to_camera(const Vec3& d) const { return glm::transpose(rotation()) * d; }
  void set_pose(const Mat3& rotation, const Vec3& position);

  bool operator==(const Camera&) const = default;
};

/// Camera of the grid of every `stride`-th pixel from (x, y) on.
Camera every_nth(const Camera& camera, int stride, int x, int y);

/// Camera at `eye` that looks at `target`; world y is up. Writes the pose into `camera`.
/// Throws usage_error when the direction is zero or parallel to y.
void look_at(Camera& camera, const Vec3& eye, const Vec3& target);

}  // namespace clerestory
