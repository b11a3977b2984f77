#include "host/ops/shade/bounce.hpp"

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

struct BounceOp : NotDifferentiable {
  int number;
  explicit BounceOp(int n) : number(n) {}
  std::string name() const override { return "bounce"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 3, "bounce"), check_rays(in[1], 1, "bounce"), check_rays(in[2], 3, "bounce");
    check_rays(in[3], 1, "bounce");
    if (in[3].type() != Type::Int || in[4].shape().item() != 5)
      throw Error(ErrorKind::Failed, "objects are integers and have five material numbers each", "bounce",
                  in[4].shape().text());
    return {{in[0].shape()}, {in[0].shape()}, {in[1].shape()}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run("shade/bounce.cl", "bounce", ray_range(t), l.in(0), l.in(1), l.in(2), l.in(3), l.in(4), l.out(0), l.out(1),
          l.out(2), t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity,
          l.in(4).shape.n, l.seed, static_cast<std::uint32_t>(number));
  }
};

}  // namespace

Bounce bounce(Value direction, Value arriving, Value normal, Value object, Value materials, int number) {
  const Value next = direction.graph().make<BounceOp>({direction, arriving, normal, object, materials}, number);
  return {next, next.node->value(1), next.node->value(2)};
}

}  // namespace clerestory
