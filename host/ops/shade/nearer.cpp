#include "host/ops/shade/nearer.hpp"

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

struct NearerOp : NotDifferentiable {
  bool of_pixels, difference;
  NearerOp(bool p, bool d) : of_pixels(p), difference(d) {}
  std::string name() const override { return "nearer"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[1], 3, "nearer"), check_rays(in[2], 1, "nearer"), check_rays(in[3], 1, "nearer"),
        check_rays(in[4], 1, "nearer");
    const Shape &rays = in[1].shape(), &depth = in[8].shape(), &points = in[0].shape();
    const Shape expected = of_pixels ? Shape{1, 3, depth.h, depth.w} : rays;
    if (depth.n != 1 || !(points == expected))
      throw Error(ErrorKind::Failed, "points belong to pixels or to rays of one picture", "nearer", points.text(),
                  expected.text());
    return {{rays}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    const Shape& depth = l.in(8).shape;
    l.run("shade/nearer.cl", "nearer", ray_range(t), l.in(0), l.in(1), l.in(2), l.in(3), l.in(4), l.in(5), l.in(6),
          l.in(7), l.in(8), l.in(9), l.in(10), l.out(), t.first_pixel, t.pixels, t.first_sample, t.samples,
          t.pixel_capacity, t.sample_capacity, static_cast<int>(of_pixels), static_cast<int>(difference), depth.w,
          depth.h);
  }
};

struct NeededRaysOp : NotDifferentiable {
  std::string name() const override { return "needed_rays"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 3, "needed_rays"), check_rays(in[1], 1, "needed_rays");
    return {{in[0].shape()}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run("shade/nearer.cl", "needed_rays", ray_range(t), l.in(0), l.in(1), l.in(2), l.out(), t.first_pixel, t.pixels,
          t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity);
  }
};

}  // namespace

Value nearer(const NearerRays& r, Value scene, Value weight, Value beyond, Value depth, Value camera, Value shows) {
  const Value mask = shows ? shows : depth;  // the kernel reads it only for differences
  return depth.graph().make<NearerOp>(
      {r.points, r.direction, r.hit, r.object, r.distance, scene, weight, beyond, depth, camera, mask}, r.of_pixels,
      static_cast<bool>(shows));
}

Value needed_rays(Value direction, Value object, Value shows) {
  return direction.graph().make<NeededRaysOp>({direction, object, shows});
}

}  // namespace clerestory
