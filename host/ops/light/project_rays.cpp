#include "host/ops/light/project_rays.hpp"

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

struct ProjectRaysOp : NotDifferentiable {
  std::string kernel;  // project_rays or mirrored_rays
  Shape picture;
  ProjectRaysOp(std::string k, const Shape& p) : kernel(std::move(k)), picture(p) {}
  std::string name() const override { return kernel; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 3, kernel.c_str());
    const Shape& rays = in[0].shape();
    if (!(in[1].shape() == Shape{in[1].shape().n, 4, 1, 1}))
      throw Error(ErrorKind::Failed, "cameras are wanted", kernel, in[1].shape().text(), "nx4x1x1");
    return {{{1, 1, rays.h, rays.w}, Type::Int}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.in(0).shape);
    l.run("light/project_rays.cl", kernel, ray_range(t), l.in(0), l.in(1), l.out(), t.first_pixel, t.pixels,
          t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, l.in(1).shape.n, picture.w, picture.h);
  }
};

}  // namespace

Value project_rays(Value direction, Value camera, const Shape& picture) {
  return direction.graph().make<ProjectRaysOp>({direction, camera}, "project_rays", picture);
}

Value mirrored_rays(Value direction, Value camera, const Shape& picture) {
  return direction.graph().make<ProjectRaysOp>({direction, camera}, "mirrored_rays", picture);
}

}  // namespace clerestory
