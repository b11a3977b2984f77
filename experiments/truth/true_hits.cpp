#include "experiments/truth/true_hits.hpp"

#include <cmath>
#include <limits>

namespace clerestory {
namespace {

// Of the distance to the camera: far above the rounding of single precision in a room, far below what hides something.
constexpr double kSlack = 1e-3;

Vec3 vector_at(const std::vector<float>& values, std::size_t i) {
  const std::size_t count = values.size() / 3;
  return {values[i], values[count + i], values[2 * count + i]};
}

/// Surfaces that may be seen: where they lie in the world, and at which pixel.
struct Candidates {
  std::vector<std::size_t> ray;
  std::vector<int> pixel;
  std::vector<Vec3> from_camera;  // world space, to the surface
};

/// The hits that lie in the camera's frustum.
Candidates before_camera(const Camera& camera, const std::vector<Vec3>& starts, const std::vector<Vec3>& directions,
                         const std::vector<TraceHit>& hits) {
  Candidates found;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].triangle < 0) continue;
    const Vec3 point = starts[i] + static_cast<double>(hits[i].t) * directions[i];
    const std::optional<Vec2> p = camera.project(camera.to_camera(point));
    if (!p || !(p->x >= 0 && p->y >= 0 && p->x < camera.width && p->y < camera.height)) continue;
    found.ray.push_back(i), found.from_camera.push_back(point - camera.position());
    found.pixel.push_back(static_cast<int>(p->y) * camera.width + static_cast<int>(p->x));
  }
  return found;
}

}  // namespace

std::vector<int> true_hits(TraceScene& traced, const Camera& camera, const std::vector<float>& points,
                           const std::vector<float>& directions) {
  const std::size_t count = points.size() / 3;
  std::vector<int> pixels(count, -1);
  std::vector<Vec3> starts(count), along(count);
  for (std::size_t i = 0; i < count; ++i)
    starts[i] = camera.to_world(vector_at(points, i)), along[i] = camera.direction_to_world(vector_at(directions, i));
  constexpr float kFar = std::numeric_limits<float>::max();
  if (count == 0) return pixels;
  const Candidates found =
      before_camera(camera, starts, along, traced.hits(planar(starts), planar(along), kRayOffset, kFar));
  if (found.ray.empty()) return pixels;
  const std::vector<Vec3> eye(found.ray.size(), camera.position());
  const std::vector<TraceHit> seen = traced.hits(planar(eye), planar(found.from_camera), 0, kFar);
  for (std::size_t k = 0; k < seen.size(); ++k)  // t = 1 is the surface itself
    if (seen[k].triangle >= 0 && seen[k].t >= 1 - kSlack) pixels[found.ray[k]] = found.pixel[k];
  return pixels;
}

}  // namespace clerestory
