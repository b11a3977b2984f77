// The points of a depth map.
#include "host/ops/light/surface_points.hpp"

#include <cmath>
#include <limits>

#include "checks/op_case.hpp"
#include "host/math/camera.hpp"

namespace clerestory {
namespace {

constexpr int kBatch = 2, kHeight = 3, kWidth = 5;

/// The camera of an item, which is rounded to float as inputs are.
Camera camera_in(const Tensor& cameras, int n) {
  Camera c = Camera::from_fov(kWidth, kHeight, 80.0);
  c.fx = cameras.at(n, 0, 0, 0), c.fy = cameras.at(n, 1, 0, 0), c.cx = cameras.at(n, 2, 0, 0);
  c.cy = cameras.at(n, 3, 0, 0);
  return c;
}

OP_CASES(surface_points) {
  OpCase c{.stem = "surface_points", .label = "holes", .kernels = {"surface_points"}};
  Tensor depth = random_tensor({kBatch, 1, kHeight, kWidth}, 5, 0.5, 4);
  depth.at(0, 0, 1, 2) = 0, depth.at(1, 0, 2, 4) = -1;
  depth.at(1, 0, 0, 1) = std::numeric_limits<double>::infinity(), depth.at(0, 0, 0, 3) = std::nan("");
  c.inputs = {{"depth", depth},
              {"camera", Tensor({kBatch, 4, 1, 1}, std::vector<double>{3, 3.1, 2.1, 1.5, 4, 3.9, 2.6, 1.4})}};
  c.build = [](Graph&, const Values& v) { return std::vector{surface_points(v.at("depth"), v.at("camera"))}; };
  c.reference = [](const Tensors& t) {
    Tensor all(Shape{kBatch, 3, kHeight, kWidth});
    for (int n = 0; n < kBatch; ++n)
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const double z = t.at("depth").at(n, 0, y, x);
          const Vec3 point =
              camera_in(t.at("camera"), n).unproject(x + 0.5, y + 0.5, z > 0 && std::isfinite(z) ? z : 0.0);
          for (int i = 0; i < 3; ++i) all.at(n, i, y, x) = point[i];
        }
    return std::vector{all};
  };
  c.roundings = 8;
  c.no_gradient = "origins of rays are detached";
  return {c};
}

}  // namespace
}  // namespace clerestory
