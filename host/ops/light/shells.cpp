#include "host/ops/light/shells.hpp"

#include "host/ops/light/rays.hpp"
#include "host/ops/light/sort_rays.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/shells.cl";

// Inputs: gradient, shares, order, starts.
struct SumShellsOp : NotDifferentiable {
  Shape shells;
  explicit SumShellsOp(const Shape& s) : shells(s) {}
  std::string name() const override { return "sum_shells"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{shells, Type::Real}}; }
  void launch(Launch& l) const override {
    if (l.chunk.pixels > 0)
      throw Error(ErrorKind::Failed, "shells have no gradient inside of map_chunks", "sum_shells");
    l.run(kFile, "sum_shells", Range::of(static_cast<std::size_t>(shells.n * shells.plane())), l.in(0), l.in(1),
          l.in(2), l.in(3), l.out(), static_cast<int>(l.in(0).shape.plane()), shells.n, shells.h, shells.w);
  }
};

// Inputs: shells, points, direction, range, radii. Outputs: value, met, cells, shares.
struct LookUpShellsOp : Op {
  std::string name() const override { return "look_up_shells"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[1], 3, "look_up_shells"), check_rays(in[2], 3, "look_up_shells");
    const Shape &shells = in[0].shape(), &rays = in[1].shape();
    if (shells.c != 4 || shells.h < 2 || shells.w < 2 || !(in[2].shape() == rays) ||
        !(in[3].shape() == Shape{1, 3, 1, 1}))
      throw Error(ErrorKind::Failed, "shells, rays and range do not fit", "look_up_shells",
                  shells.text() + ", " + in[2].shape().text() + ", " + in[3].shape().text(),
                  "Kx4xROWSxCOLUMNS, " + rays.text() + ", 1x3x1x1");
    return {{{shells.n, 4, rays.h, rays.w}, Type::Real},
            {{shells.n, 1, rays.h, rays.w}, Type::Real},
            {{1, 1, 1, shells.n * static_cast<int>(rays.plane())}, Type::Int},
            {{shells.n, 2, rays.h, rays.w}, Type::Real}};
  }
  Slope slope(int input, int output) const override {
    if (input > 0) return Slope::None;
    return output == 0 ? Slope::Adjoint : Slope::Detached;  // where a ray meets them does not depend on their paint
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    const Shape shells = node.in_shape(0);
    const SortedRays sorted = sort_rays(node.value(2), {1, 1, shells.n * shells.h, shells.w});
    return {node.graph->make<SumShellsOp>({g[0], node.value(3), sorted.order, sorted.starts}, shells), {}, {}, {}, {}};
  }
  void launch(Launch& l) const override {
    const Shape& shells = l.in(0).shape;
    const RayTile t = ray_tile(l, l.in(1).shape);
    l.run(kFile, "look_up_shells", ray_range(t), l.in(0), l.in(1), l.in(2), l.in(3), l.in(4), l.out(0), l.out(1),
          l.out(2), l.out(3), t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity,
          shells.n, shells.h, shells.w);
  }
};

}  // namespace

ShellSamples look_up_shells(Value shells, Value points, Value direction, Value range,
                            const std::vector<double>& radii) {
  const int count = shells.shape().n;
  if (static_cast<int>(radii.size()) != count)
    throw Error(ErrorKind::Failed, "another number of radii than of shells", "look_up_shells",
                std::to_string(radii.size()), std::to_string(count));
  const Value r = shells.graph().constant(Tensor({count, 1, 1, 1}, radii));
  const Value value = shells.graph().make<LookUpShellsOp>({shells, points, direction, range, r});
  return {value, value.node->value(1)};
}

}  // namespace clerestory
