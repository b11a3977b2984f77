#include "host/math/camera.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr double default_fov_degrees = 65;  // across the longer side
constexpr double pose_tolerance = 1e-3;     // of a rotation written with four digits

double radians(double degrees) { return degrees * glm::pi<double>() / 180; }

void check_size(int width, int height, const std::string& where) {
  if (width <= 0 || height <= 0)
    throw usage_error("the image size is not positive", where, fmt::format("{}x{}", width, height), "at least 1x1");
}

void check_pose(const Camera& camera, const std::string& where) {
  const auto& m = camera.camera_to_world;
  if (!std::all_of(m.begin(), m.end(), [](double v) { return std::isfinite(v); }))
    throw usage_error("camera_to_world holds a number that is not finite", where);
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
    throw usage_error("the last row of camera_to_world is wrong", where,
                      fmt::format("{} {} {} {}", m[12], m[13], m[14], m[15]), "0 0 0 1 (row-major)");
  const Mat3 r = camera.rotation();
  const Mat3 gram = glm::transpose(r) * r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (std::abs(gram[i][j] - (i == j ? 1 : 0)) > pose_tolerance)
        throw usage_error("the rotation of camera_to_world is not orthonormal", where,
                          fmt::format("{:.4g} at ({}, {}) of its Gram matrix", gram[i][j], i, j));
  if (glm::determinant(r) < 0)
    throw usage_error("the rotation of camera_to_world mirrors", where, "determinant -1", "determinant 1");
}

}  // namespace

Camera Camera::from_fov(int width, int height, std::optional<double> fov_degrees) {
  check_size(width, height, "image");
  if (fov_degrees && !(*fov_degrees > 0 && *fov_degrees < 180))
    throw usage_error("the horizontal field of view is out of range", "--fov", fmt::format("{}", *fov_degrees),
                      "degrees between 0 and 180");
  const double span = fov_degrees ? width : std::max(width, height);
  Camera camera;
  camera.width = width, camera.height = height;
  camera.fx = camera.fy = span / 2 / std::tan(radians(fov_degrees.value_or(default_fov_degrees)) / 2);
  camera.cx = width / 2.0, camera.cy = height / 2.0;
  return camera;
}

void Camera::check(const std::string& where) const {
  check_size(width, height, where);
  for (auto [name, value] : {std::pair{"fx", fx}, {"fy", fy}})
    if (!(value > 0) || !std::isfinite(value))
      throw usage_error(fmt::format("the focal length {} is wrong", name), where, fmt::format("{}", value),
                        "a positive number of pixels");
  for (auto [name, value] : {std::pair{"cx", cx}, {"cy", cy}})
    if (!std::isfinite(value))
      throw usage_error(fmt::format("the principal point {} is not finite", name), where, fmt::format("{}", value));
  check_pose(*this, where);
}

Camera Camera::resized(int new_width, int new_height) const {
  check_size(new_width, new_height, "resized image");
  const double sx = static_cast<double>(new_width) / width, sy = static_cast<double>(new_height) / height;
  Camera camera = *this;
  camera.width = new_width, camera.height = new_height;
  // With centres at halves the image spans [0, width], so scaling has no offset.
  camera.fx *= sx, camera.cx *= sx, camera.fy *= sy, camera.cy *= sy;
  return camera;
}

double Camera::fov_degrees() const {
  return (std::atan(cx / fx) + std::atan((width - cx) / fx)) * 180 / glm::pi<double>();
}

Vec3 Camera::direction(double x, double y) const { return glm::normalize(ray(x, y)); }

std::optional<Vec2> Camera::project(const Vec3& p) const {
  if (!(p.z < 0)) return std::nullopt;
  return Vec2(cx - fx * p.x / p.z, cy + fy * p.y / p.z);
}

Mat3 Camera::rotation() const {
  const auto& m = camera_to_world;
  return {{m[0], m[4], m[8]}, {m[1], m[5], m[9]}, {m[2], m[6], m[10]}};  // GLM's constructor takes columns
}

Vec3 Camera::position() const { return {camera_to_world[3], camera_to_world[7], camera_to_world[11]}; }

void Camera::set_pose(const Mat3& r, const Vec3& p) {
  camera_to_world = {r[0].x, r[1].x, r[2].x, p.x, r[0].y, r[1].y, r[2].y, p.y, r[0].z, r[1].z, r[2].z, p.z, 0, 0, 0, 1};
}

void look_at(Camera& camera, const Vec3& eye, const Vec3& target) {
  const Vec3 forward = target - eye;
  const Vec3 right = glm::cross(forward, Vec3(0, 1, 0));
  // Without a horizontal part there is no level picture; 1e-9 is far above rounding and below any aim.
  if (!(glm::length(right) > 1e-9 * glm::length(forward)))
    throw usage_error("the view direction is zero or vertical", "look_at",
                      fmt::format("({}, {}, {})", forward.x, forward.y, forward.z));
  const Vec3 z = -glm::normalize(forward), x = glm::normalize(right);
  camera.set_pose(Mat3(x, glm::cross(z, x), z), eye);
}

Camera every_nth(const Camera& camera, int stride, int x, int y) {
  Camera out = camera;
  out.width = camera.width / stride, out.height = camera.height / stride;
  out.fx /= stride, out.fy /= stride;
  // The centre of coarse pixel i is that of pixel stride i + x: (i + 0.5) stride + (x + 0.5 - 0.5 stride).
  out.cx = (camera.cx - (x + 0.5) + 0.5 * stride) / stride;
  out.cy = (camera.cy - (y + 0.5) + 0.5 * stride) / stride;
  return out;
}

}  // namespace clerestory
