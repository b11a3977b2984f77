// Boxes around normals, by what they promise: they hold every normal of their block and are no wider than two steps.
#include "host/ops/light/normal_pyramid.hpp"

#include <cmath>

#include "checks/light/ssrt_scenes.hpp"
#include "checks/op_case.hpp"
#include "host/ops/light/depth_pyramid.hpp"

namespace clerestory {
namespace {

constexpr int kSteps = 510, kMost = 511;

int corner(const int (&steps)[3]) { return (steps[0] + kMost) | (steps[1] + kMost) << 10 | (steps[2] + kMost) << 20; }

/// Grows a box by one normal; one without a direction may face anywhere.
void take_in(const Vec3& normal, int (&low)[3], int (&high)[3]) {
  const double largest = std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
  const bool direction = largest > 0 && std::isfinite(normal.x) && std::isfinite(normal.y) && std::isfinite(normal.z);
  for (int c = 0; c < 3; ++c) {
    const double steps = direction ? kSteps * normal[c] / largest : 0;
    low[c] = std::min(low[c], direction ? static_cast<int>(std::floor(steps - 0.25)) : -kMost);
    high[c] = std::max(high[c], direction ? static_cast<int>(std::ceil(steps + 0.25)) : kMost);
  }
}

Tensor pyramid_reference(const Tensor& normal) {
  const Shape& s = normal.shape;
  const PyramidLayout layout = pyramid_layout(s.w, s.h);
  const int nothing_low[3]{kMost, kMost, kMost}, nothing_high[3]{-kMost, -kMost, -kMost};
  Tensor all = Tensor::of_int({s.n, 1, layout.level_rows, 2 * layout.stride}, {});
  for (long i = 0; i < all.shape.count(); ++i) all.integer.push_back(corner(i % 2 ? nothing_high : nothing_low));
  for (int n = 0; n < s.n; ++n)
    for (int level = 0; level < layout.levels; ++level)
      for (int y = 0; y << level < s.h; ++y)
        for (int x = 0; x << level < s.w; ++x) {
          int low[3]{kMost, kMost, kMost}, high[3]{-kMost, -kMost, -kMost};
          for (int j = y << level; j < std::min(s.h, (y + 1) << level); ++j)
            for (int i = x << level; i < std::min(s.w, (x + 1) << level); ++i)
              take_in({normal.at(n, 0, j, i), normal.at(n, 1, j, i), normal.at(n, 2, j, i)}, low, high);
          const long row = static_cast<long>(n) * layout.level_rows + layout.row(level) + y;
          const auto at = static_cast<std::size_t>(2 * (row * layout.stride + x));
          all.integer[at] = corner(low), all.integer[at + 1] = corner(high);
        }
  return all;
}

OP_CASES(normal_pyramid) {
  OpCase boxes{.stem = "normal_pyramid", .label = "batch", .kernels = {"normal_base", "normal_level"}};
  Tensor normal = ssrt_scenes::random_normals(2, 13, 21, 32);
  const double strange[][3]{{0, 0, 0}, {NAN, 1, 0}, {0, INFINITY, 1}, {3e30, -1e30, 0}, {1e-30, 0, -2e-30}, {0, -1, 0}};
  for (int i = 0; i < 6; ++i)
    for (int c = 0; c < 3; ++c) normal.at(1, c, 5, 3 * i) = static_cast<float>(strange[i][c]);
  boxes.inputs = {{"normal", normal}};
  boxes.build = [](Graph&, const Values& v) { return std::vector<Value>{normal_pyramid(v.at("normal"))}; };
  boxes.reference = [](const Tensors& t) { return std::vector<Tensor>{pyramid_reference(t.at("normal"))}; };
  boxes.no_gradient = "steers where rays look, not what they find";
  return {boxes};
}

}  // namespace
}  // namespace clerestory
