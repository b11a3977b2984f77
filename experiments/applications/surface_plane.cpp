#include "experiments/applications/surface_plane.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace clerestory {
namespace {

constexpr int kLeastReach = 3;  // pixels
constexpr int kRefits = 8;
constexpr double kUnlike = 0.01, kFar = 0.1;  // of depth: an error that halves a pixel's weight; at first
constexpr std::size_t kLeastDepths = 12;

struct Depths {
  std::vector<Vec3> rays;
  std::vector<double> inverse;  // 1 / depth, of the centre's
};

Depths depths_around(const Scene& scene, int x, int y) {
  const int reach = std::max(kLeastReach, scene.width() / 50);
  const auto centre = static_cast<double>(scene.depth.at(0, y, x));
  Depths all;
  for (int v = std::max(0, y - reach); v <= std::min(scene.height() - 1, y + reach); ++v)
    for (int u = std::max(0, x - reach); u <= std::min(scene.width() - 1, x + reach); ++u)
      if (const auto z = static_cast<double>(scene.depth.at(0, v, u)); z > 0 && std::isfinite(z))
        all.rays.push_back(scene.camera.ray(u + 0.5, v + 0.5)), all.inverse.push_back(centre / z);
  return all;
}

}  // namespace

std::optional<Vec3> plane_normal_at(const Scene& scene, int x, int y) {
  if (!(scene.depth.at(0, y, x) > 0)) return {};
  const Depths depths = depths_around(scene, x, y);
  const Vec3 ray = scene.camera.ray(x + 0.5, y + 0.5);
  if (depths.rays.size() < kLeastDepths) return {};
  Vec3 plane;
  for (int fit = 0; fit < kRefits; ++fit) {
    Mat3 gram(0);
    Vec3 slope(0);
    for (std::size_t i = 0; i < depths.rays.size(); ++i) {
      const Vec3& r = depths.rays[i];
      const double off =
          fit == 0 ? (depths.inverse[i] - 1) / kFar : (glm::dot(plane, r) / depths.inverse[i] - 1) / kUnlike;
      const double weight = 1 / (1 + off * off);
      gram += weight * glm::outerProduct(r, r), slope += weight * depths.inverse[i] * r;
    }
    if (!(std::abs(glm::determinant(gram)) > 0)) return {};
    plane = glm::inverse(gram) * slope;
  }
  if (!(glm::dot(plane, ray) > 0)) return {};  // it would face away
  return -glm::normalize(plane);
}

}  // namespace clerestory
