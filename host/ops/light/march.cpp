#include "host/ops/light/march.hpp"

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

struct MarchOp : NotDifferentiable {
  MarchOptions options;
  Shape picture;
  MarchOp(const MarchOptions& o, const Shape& p) : options(o), picture(p) {}
  std::string name() const override { return "march"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 3, "march"), check_rays(in[1], 3, "march");
    const Shape &rays = in[0].shape(), &range = in[2].shape();
    if (!(in[1].shape() == rays) || range.c != 3 || range.plane() != 1)
      throw Error(ErrorKind::Failed, "points, directions and the range of depths do not fit", "march",
                  in[1].shape().text() + " and " + range.text(), rays.text() + " and nx3x1x1");
    return {{{options.segments, 3, rays.h, rays.w}, Type::Real}, {{options.segments, 1, rays.h, rays.w}, Type::Real}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.in(0).shape);
    const Defines defines = options.jitter ? Defines{{"JITTER", "1"}} : Defines{};
    l.run_with(defines, "light/march.cl", "march", ray_range(t), l.in(0), l.in(1), l.in(2), l.out(0), l.out(1),
               t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, l.in(2).shape.n,
               static_cast<int>(picture.plane()), options.segments, Launch::Real{options.near},
               Launch::Real{options.radius}, l.seed);
  }
};

}  // namespace

Marched march(Value points, Value direction, Value range, const Shape& picture, const MarchOptions& options) {
  if (options.segments < 1 || !(options.near >= 0) || !(options.radius > 0))
    throw Error(ErrorKind::Failed, "segments, near distance or radius out of range", "march");
  const Value position = points.graph().make<MarchOp>({points, direction, range}, options, picture);
  return {position, position.node->value(1)};
}

}  // namespace clerestory
