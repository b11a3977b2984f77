#include "host/ops/light/surface_points.hpp"

#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reshape.hpp"

namespace clerestory {
namespace {

struct SurfacePointsOp : NotDifferentiable {
  std::string name() const override { return "surface_points"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    if (s.c != 1 || !(in[1].shape() == Shape{s.n, 4, 1, 1}))
      throw Error(ErrorKind::Failed, "a depth map and its camera are wanted", "surface_points",
                  s.text() + " and " + in[1].shape().text(), "nx1xhxw and nx4x1x1");
    return {{{s.n, 3, s.h, s.w}, Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    l.run("light/surface_points.cl", "surface_points",
          Range::of2(static_cast<std::size_t>(s.plane()), static_cast<std::size_t>(s.n)), l.in(0), l.in(1), l.out(),
          s.w, s.h);
  }
};

}  // namespace

Value surface_points(Value depth, Value camera) { return depth.graph().make<SurfacePointsOp>({depth, camera}); }

Value ray_origins(Value points, int samples) {
  const int pixels = static_cast<int>(points.shape().plane());
  return reshape(expand(reshape(points, {3 * pixels, 1, 1, 1}), {3 * pixels, 1, 1, samples}), {1, 3, pixels, samples});
}

}  // namespace clerestory
