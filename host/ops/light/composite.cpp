#include "host/ops/light/composite.hpp"

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/composite.cl";

// Inputs: density, colour, length, gradients of radiance and transmittance.
struct CompositeAdjointOp : NotDifferentiable {
  std::string name() const override { return "composite_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{in[0].shape(), Type::Real}, {in[1].shape(), Type::Real}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run(kFile, "composite_adjoint", ray_range(t), l.in(0), l.in(1), l.in(2), l.in(3), l.in(4), l.out(0), l.out(1),
          t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, l.in(0).shape.n);
  }
};

struct CompositeOp : Op {
  std::string name() const override { return "composite"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    const Shape colour{s.n, 3, s.h, s.w};
    if (s.c != 1 || s.w % 16 != 0 || !(in[1].shape() == colour) || !(in[2].shape() == s))
      throw Error(ErrorKind::Failed, "segments of unlike rays", "composite",
                  fmt::format("{}, {} and {}", s.text(), in[1].shape().text(), in[2].shape().text()),
                  "Kx1, Kx3 and Kx1 of the same rays, samples in sixteens");
    return {{{1, 3, s.h, s.w}, Type::Real}, {{1, 1, s.h, s.w}, Type::Real}};
  }
  Slope slope(int input, int) const override { return input < 2 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    const auto given = [&](std::size_t output) {
      return g[output] ? g[output] : node.graph->fill(node.outputs[output].shape, 0);
    };
    const Value first =
        node.graph->make<CompositeAdjointOp>({node.inputs[0], node.inputs[1], node.inputs[2], given(0), given(1)});
    return {first, first.node->value(1), {}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run(kFile, "composite", ray_range(t), l.in(0), l.in(1), l.in(2), l.out(0), l.out(1), t.first_pixel, t.pixels,
          t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, l.in(0).shape.n);
  }
};

}  // namespace

Composited composite(Value density, Value colour, Value length) {
  const Value radiance = density.graph().make<CompositeOp>({density, colour, length});
  return {radiance, radiance.node->value(1)};
}

}  // namespace clerestory
