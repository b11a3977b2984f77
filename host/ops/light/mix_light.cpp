#include "host/ops/light/mix_light.hpp"

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/mix_light.cl";

struct MixLightAdjointOp : NotDifferentiable {
  std::string name() const override { return "mix_light_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{in[0].shape()}, {in[1].shape()}, {in[2].shape()}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run(kFile, "mix_light_adjoint", ray_range(t), l.in(0), l.in(1), l.in(2), l.in(3), l.out(0), l.out(1), l.out(2),
          t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity);
  }
};

struct MixLightOp : Op {
  std::string name() const override { return "mix_light"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 3, "mix_light"), check_rays(in[1], 3, "mix_light"), check_rays(in[2], 1, "mix_light");
    const Shape &near = in[0].shape(), &u = in[2].shape();
    if (!(in[1].shape() == near) || u.h != near.h || u.w != near.w)
      throw Error(ErrorKind::Failed, "the lights are of different rays", "mix_light", in[1].shape().text(),
                  near.text());
    return {{near}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    const Value first = node.graph->make<MixLightAdjointOp>({node.inputs[0], node.inputs[1], node.inputs[2], g[0]});
    return {first, first.node->value(1), first.node->value(2)};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run(kFile, "mix_light", ray_range(t), l.in(0), l.in(1), l.in(2), l.out(), t.first_pixel, t.pixels, t.first_sample,
          t.samples, t.pixel_capacity, t.sample_capacity);
  }
  int overwrites() const override { return 0; }
};

}  // namespace

Value mix_light(Value near, Value far, Value u) { return near.graph().make<MixLightOp>({near, far, u}); }

}  // namespace clerestory
