// The pyramid of depths that steers screen-space rays, by the definition of a level.
#include "host/ops/light/depth_pyramid.hpp"

#include <cmath>

#include "checks/light/ssrt_scenes.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

Tensor pyramid_reference(const Tensor& depth) {
  const Shape& s = depth.shape;
  const PyramidLayout layout = pyramid_layout(s.w, s.h);
  Tensor all(Shape{s.n, 1, layout.level_rows, layout.stride}, -1);
  for (int n = 0; n < s.n; ++n)
    for (int level = 0; level < layout.levels; ++level)
      for (int y = 0; y << level < s.h; ++y)
        for (int x = 0; x << level < s.w; ++x) {
          double most = -1;
          for (int j = y << level; j < std::min(s.h, (y + 1) << level); ++j)
            for (int i = x << level; i < std::min(s.w, (x + 1) << level); ++i)
              if (depth.at(n, 0, j, i) > 0 && std::isfinite(depth.at(n, 0, j, i)))
                most = std::max(most, 1 / depth.at(n, 0, j, i));
          all.at(n, 0, layout.row(level) + y, x) = most;
        }
  return all;
}

OP_CASES(depth_pyramid) {
  OpCase pyramid{.stem = "depth_pyramid", .label = "batch", .kernels = {"pyramid_base", "pyramid_level"}};
  pyramid.inputs = {{"depth", ssrt_scenes::landscape(2, 13, 21, 32)}};
  for (const int y : {2, 3})  // a cell of the next level that measures nothing
    for (const int x : {4, 5}) pyramid.inputs["depth"].at(1, 0, y, x) = y == 2 ? INFINITY : x == 4 ? NAN : -1;
  pyramid.build = [](Graph&, const Values& v) { return std::vector<Value>{depth_pyramid(v.at("depth"))}; };
  pyramid.reference = [](const Tensors& t) { return std::vector<Tensor>{pyramid_reference(t.at("depth"))}; };
  pyramid.roundings = 1;
  pyramid.no_gradient = "steers where rays look, not what they find";
  return {pyramid};
}

}  // namespace
}  // namespace clerestory
