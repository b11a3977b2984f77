#include "host/ops/light/rescale_hits.hpp"

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

struct RescaleHitsOp : NotDifferentiable {
  Shape from, to;
  RescaleHitsOp(const Shape& f, const Shape& t) : from(f), to(t) {}
  std::string name() const override { return "rescale_hits"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 1, "rescale_hits");
    if (in[0].type() != Type::Int)
      throw Error(ErrorKind::Failed, "pixel indices are wanted", "rescale_hits", in[0].shape().text());
    return {{in[0].shape(), Type::Int}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run("light/rescale_hits.cl", "rescale_hits", ray_range(t), l.in(0), l.out(), t.first_pixel, t.pixels,
          t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, from.w, from.h, to.w, to.h);
  }
};

}  // namespace

Value rescale_hits(Value hit, const Shape& from, const Shape& to) {
  if (from.h == to.h && from.w == to.w) return hit;
  return hit.graph().make<RescaleHitsOp>({hit}, from, to);
}

}  // namespace clerestory
