#include "host/ops/light/gather_rays.hpp"

#include "host/ops/light/rays.hpp"
#include "host/ops/light/sort_rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/gather_rays.cl";

// Inputs: gradient of rays, order, starts.
struct SumSegmentsOp : NotDifferentiable {
  Shape map;
  explicit SumSegmentsOp(const Shape& m) : map(m) {}
  std::string name() const override { return "sum_segments"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{map, Type::Real}}; }
  void launch(Launch& l) const override {
    const Blocks blocks = row_blocks(l.device, map.plane());
    l.run_with(row_defines(l.device), kFile, "sum_segments", row_range(l.device, blocks.count, map.c, map.n), l.in(0),
               l.in(1), l.in(2), l.out(), static_cast<int>(l.in(0).shape.plane()), static_cast<int>(map.plane()),
               blocks.length);
  }
};

struct GatherRaysOp : Op {
  std::string name() const override { return "gather_rays"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[1], 1, "gather_rays");
    if (in[1].type() != Type::Int)
      throw Error(ErrorKind::Failed, "pixel indices are wanted", "gather_rays", in[1].shape().text());
    return {{{1, in[0].shape().c, in[1].shape().h, in[1].shape().w}, Type::Real}};
  }
  Slope slope(int input, int) const override { return input == 0 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {scatter_rays(g[0], node.inputs[1], node.in_shape(0)), {}};
  }
  void launch(Launch& l) const override {
    const Shape& map = l.in(0).shape;
    const RayTile t = ray_tile(l, l.out().shape);
    const Blocks blocks = row_blocks(l.device, static_cast<long>(t.pixels) * t.sample_capacity);
    l.run_with(row_defines(l.device), kFile, "gather_rays", row_range(l.device, blocks.count, map.c), l.in(0), l.in(1),
               l.out(), t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, map.n,
               static_cast<int>(map.plane()), blocks.length);
  }
};

}  // namespace

Value gather_rays(Value map, Value hit) { return map.graph().make<GatherRaysOp>({map, hit}); }

Value scatter_rays(Value rays, Value hit, const Shape& map) {
  const SortedRays sorted = sort_rays(hit, map);
  return rays.graph().make<SumSegmentsOp>({rays, sorted.order, sorted.starts}, map);
}

}  // namespace clerestory
