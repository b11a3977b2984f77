// Which way blocks of a depth map face, by the definition of a block's ball.
#include "host/ops/light/facing_pyramid.hpp"

#include <algorithm>
#include <cmath>

#include "checks/light/ssrt_scenes.hpp"
#include "checks/op_case.hpp"
#include "host/ops/light/depth_pyramid.hpp"

namespace clerestory {
namespace {

constexpr double kSteps = 127;

/// The ball around unit normals in whole steps, its radius in the highest byte.
int ball_of(const std::vector<Vec3>& normals) {
  Vec3 sum(0);
  for (const Vec3& n : normals) sum += n;
  const Vec3 middle = glm::round(sum * (kSteps / std::max<double>(static_cast<double>(normals.size()), 1)));
  double farthest = 0;
  for (const Vec3& n : normals) {
    const double off = glm::length(n - middle / kSteps);
    if (!(off < 2)) return static_cast<int>(255u << 24);
    farthest = std::max(farthest, off);
  }
  unsigned ball = static_cast<unsigned>(std::min(static_cast<int>(kSteps * farthest) + 1, 255)) << 24;
  for (int c = 0; c < 3; ++c) ball |= (static_cast<unsigned>(static_cast<int>(middle[c])) & 255u) << (8 * c);
  return static_cast<int>(ball);
}

Tensor facing_reference(const Tensor& depth, const Tensor& normal) {
  const Shape& s = depth.shape;
  const PyramidLayout layout = pyramid_layout(s.w, s.h);
  const Shape all{s.n, 1, layout.level_rows, layout.stride};
  std::vector<int> balls(static_cast<std::size_t>(all.count()), 0);
  for (int n = 0; n < s.n; ++n)
    for (int level = 0; level < layout.levels; ++level)
      for (int y = 0; y << level < s.h; ++y)
        for (int x = 0; x << level < s.w; ++x) {
          std::vector<Vec3> normals;
          for (int j = y << level; j < std::min(s.h, (y + 1) << level); ++j)
            for (int i = x << level; i < std::min(s.w, (x + 1) << level); ++i)
              if (depth.at(n, 0, j, i) > 0)
                normals.push_back(
                    glm::normalize(Vec3(normal.at(n, 0, j, i), normal.at(n, 1, j, i), normal.at(n, 2, j, i))));
          balls[static_cast<std::size_t>(n * all.item() + (layout.row(level) + y) * layout.stride + x)] =
              ball_of(normals);
        }
  return Tensor::of_int(all, std::move(balls));
}

OP_CASES(facing_pyramid) {
  OpCase pyramid{.stem = "facing_pyramid", .label = "batch", .kernels = {"facing_level"}};
  pyramid.inputs = {{"depth", ssrt_scenes::landscape(2, 13, 21, 32)},
                    {"normal", ssrt_scenes::random_normals(2, 13, 21, 33)}};
  Tensor& normal = pyramid.inputs["normal"];
  for (int c = 0; c < 3; ++c) normal.at(1, c, 4, 5) = 0, normal.at(1, c, 9, 9) *= 1e4;
  for (int y = 8; y < 13; ++y)  // a wall
    for (int x = 0; x < 8; ++x)
      for (int c = 0; c < 3; ++c) normal.at(0, c, y, x) = c == 0;
  pyramid.build = [](Graph&, const Values& v) {
    return std::vector<Value>{facing_pyramid(v.at("depth"), v.at("normal"))};
  };
  pyramid.reference = [](const Tensors& t) {
    return std::vector<Tensor>{facing_reference(t.at("depth"), t.at("normal"))};
  };
  pyramid.no_gradient = "steers where rays look, not what they find";
  return {pyramid};
}

}  // namespace
}  // namespace clerestory
