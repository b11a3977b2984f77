#include "host/ops/light/soft_lamps.hpp"

#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/soft_lamps.cl";

/// Inputs 1 to 5 of both ops: points, direction, u, pdf, places.
void check(std::span<const Value> in, const char* op) {
  check_rays(in[0], 3, op), check_rays(in[2], 3, op), check_rays(in[3], 1, op), check_rays(in[4], 1, op);
  check_points(in[1], in[0], op);
  const Shape &rays = in[0].shape(), &places = in[5].shape();
  const auto of_one = [&](Value v) { return v.shape() == Shape{1, 1, rays.h, rays.w}; };
  if (!(in[2].shape() == rays) || !of_one(in[3]) || !of_one(in[4]))
    throw Error(ErrorKind::Failed, "directions, u and pdf are of different rays", op, in[2].shape().text(),
                rays.text());
  if (!(places == Shape{1, 4, 1, places.w}) || places.w < 1)
    throw Error(ErrorKind::Failed, "places of lamps are wanted", op, places.text(), "1x4x1xK");
}

int lamps_of(const Launch& l) { return l.in(5).shape.w; }
int per_row(const Launch& l) { return l.in(1).shape.w == 1 && l.in(0).shape.w != 1; }

struct WeighLampsOp : NotDifferentiable {
  std::string name() const override { return "weigh_lamps"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check(in, "weigh_lamps");
    return {{{in[0].shape().h, 3, 1, in[5].shape().w}}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.in(0).shape);
    l.run_with(row_defines(l.device), kFile, "weigh_lamps", row_range(l.device, lamps_of(l), t.pixel_capacity), l.in(0),
               l.out(), l.in(1), l.in(2), l.in(3), l.in(4), l.in(5), lamps_of(l), per_row(l), t.first_pixel, t.pixels,
               t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity);
  }
};

struct AddLampsOp : Op {
  std::string name() const override { return "add_lamps"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check(in, "add_lamps");
    if (!(in[6].shape() == Shape{1, 3, 1, in[5].shape().w}))
      throw Error(ErrorKind::Failed, "one colour for each lamp is wanted", "add_lamps", in[6].shape().text(),
                  in[5].shape().text());
    return {{in[0].shape()}};
  }
  Slope slope(int input, int) const override { return input == 0 || input == 6 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    const std::vector<Value>& in = node.inputs;
    const Value rows = weigh_lamps(g[0], {in[1], in[2], in[3], in[4]}, in[5]);
    return {g[0], {}, {}, {}, {}, {}, sum_to(rows, in[6].shape())};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run_with(row_defines(l.device), kFile, "add_lamps", row_range(l.device, t.pixels), l.in(0), l.in(6), l.out(),
               l.in(1), l.in(2), l.in(3), l.in(4), l.in(5), lamps_of(l), per_row(l), t.first_pixel, t.pixels,
               t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity);
  }
  int overwrites() const override { return 0; }
};

}  // namespace

Value add_lamps(Value radiance, const LampRays& rays, Value places, Value colors) {
  return radiance.graph().make<AddLampsOp>({radiance, rays.points, rays.direction, rays.u, rays.pdf, places, colors});
}

Value weigh_lamps(Value weight, const LampRays& rays, Value places) {
  return weight.graph().make<WeighLampsOp>({weight, rays.points, rays.direction, rays.u, rays.pdf, places});
}

}  // namespace clerestory
