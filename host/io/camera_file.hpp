// camera.json: width, height, fx, fy, cx, cy, camera_to_world (16 numbers, row-major, metres), exposure.
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "host/math/camera.hpp"

namespace clerestory {

struct CameraFile {
  Camera camera;                   // this project's convention, pose identity when the file has none
  bool has_pose = false;           // camera_to_world was present
  std::optional<double> exposure;  // factor already applied to generated pictures
  std::optional<double> baseline;  // metres, key baseline_m of a rectified pair
  bool integer_centres = false;    // the file was of the RGB-D kind and half a pixel was added to cx and cy
  std::optional<std::array<double, 5>> distortion;  // k1 k2 p1 p2 k3 of an RGB-D file, when known and not all zero
};

/// Keys other than the above are passed over (notes, sources). A file with the key `distortion` or `depth_kind` follows
/// the convention of RGB-D benchmarks, where the centre of pixel (0, 0) is at (0, 0): it is converted. Throws
/// usage_error naming file and key.
CameraFile read_camera(const std::filesystem::path& path);

/// Writes all keys, camera_to_world included; doubles read back to the same bits.
void write_camera(const std::filesystem::path& path, const Camera& camera,
                  std::optional<double> exposure = std::nullopt);

}  // namespace clerestory
