#include "host/ops/shade/bounce.hpp"

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

// Inputs: direction, normal, object, materials and, with lobes, their specular share and density.
struct BounceOp : NotDifferentiable {
  int number;
  bool lobes;
  BounceOp(int n, bool l) : number(n), lobes(l) {}
  std::string name() const override { return "bounce"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 3, "bounce"), check_rays(in[1], 3, "bounce"), check_rays(in[2], 1, "bounce");
    if (in[2].type() != Type::Int || in[3].shape().item() != 5)
      throw Error(ErrorKind::Failed, "objects are integers and have five material numbers each", "bounce",
                  in[3].shape().text());
    if (!lobes) return {{in[0].shape()}, {in[0].shape()}};
    check_lobes({in[4], in[5]}, in[0], "bounce");
    return {{in[0].shape()}, {in[0].shape()}, {in[4].shape()}, {in[5].shape()}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run_with(lobes ? Defines{{"LOBES", "1"}} : Defines{}, "shade/bounce.cl", "bounce", ray_range(t), l.inputs,
               l.outputs, t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity,
               l.in(3).shape.n, l.seed, static_cast<std::uint32_t>(number));
  }
};

}  // namespace

Bounce bounce(Value direction, Value normal, Value object, Value materials, const Lobes& arriving, int number) {
  const bool lobes = static_cast<bool>(arriving);
  std::vector<Value> in{direction, normal, object, materials};
  if (lobes) in.insert(in.end(), {arriving.specular, arriving.density});
  const Value next = direction.graph().make<BounceOp>(in, number, lobes);
  const auto output = [&](int k) { return next.node->value(k); };
  return {next, output(1), lobes ? Lobes{output(2), output(3)} : Lobes{}};
}

}  // namespace clerestory
