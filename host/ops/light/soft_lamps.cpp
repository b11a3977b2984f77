#include "host/ops/light/soft_lamps.hpp"

#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/soft_lamps.cl";

// Inputs of all three ops: weight or radiance, points, direction, u, places; specular and density of lobes, if any;
// colors, where they are read.
constexpr std::size_t kRays = 5;

std::vector<Value> inputs_of(Value first, const LampRays& rays, Value places, Value colors) {
  std::vector<Value> in{first, rays.points, rays.direction, rays.u, places};
  if (rays.lobes) in.insert(in.end(), {rays.lobes.specular, rays.lobes.density});
  if (colors) in.push_back(colors);
  return in;
}

LampRays rays_of(std::span<const Value> in, bool lobes) {
  return {in[1], in[2], in[3], lobes ? Lobes{in[kRays], in[kRays + 1]} : Lobes{}};
}

void check(std::span<const Value> in, bool lobes, const char* op) {
  check_rays(in[0], 3, op), check_rays(in[2], 3, op), check_rays(in[3], 1, op);
  check_points(in[1], in[0], op);
  const Shape &rays = in[0].shape(), &places = in[4].shape();
  if (!(in[2].shape() == rays) || !(in[3].shape() == Shape{1, 1, rays.h, rays.w}))
    throw Error(ErrorKind::Failed, "directions and u are of different rays", op, in[2].shape().text(), rays.text());
  check_lobes(rays_of(in, lobes).lobes, in[0], op);
  if (!(places == Shape{1, 4, 1, places.w}) || places.w < 1)
    throw Error(ErrorKind::Failed, "places of lamps are wanted", op, places.text(), "1x4x1xK");
}

/// Runs `kernel` over rows, of each lamp or of all: the first input, the kernel's `own` tensors, then those of the
/// rays.
void run(Launch& l, const char* kernel, bool lobes, bool of_lamps, const std::vector<TensorView>& own) {
  const Shape& rays = l.in(0).shape;
  const RayTile t = ray_tile(l, rays);
  const int lamps = l.in(4).shape.w;
  Defines defines = row_defines(l.device);
  if (l.in(1).shape.w == 1 && rays.w != 1) defines["ROW_STARTS"] = "1";
  if (lobes) defines["LOBES"] = "1";
  const std::vector<TensorView> of_rays(l.inputs.begin() + 1,
                                        l.inputs.begin() + static_cast<std::ptrdiff_t>(kRays + (lobes ? 2 : 0)));
  const Range range = of_lamps ? row_range(l.device, lamps, t.pixel_capacity) : row_range(l.device, t.pixels);
  l.run_with(defines, kFile, kernel, range, l.in(0), own, of_rays, lamps, t.first_pixel, t.pixels, t.first_sample,
             t.samples, t.pixel_capacity, t.sample_capacity);
}

struct WeighLampsOp : NotDifferentiable {
  bool lobes;
  explicit WeighLampsOp(bool l) : lobes(l) {}
  std::string name() const override { return "weigh_lamps"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check(in, lobes, "weigh_lamps");
    return {{{in[0].shape().h, 3, 1, in[4].shape().w}}};
  }
  void launch(Launch& l) const override { run(l, "weigh_lamps", lobes, true, {l.out()}); }
};

struct AddLampsAdjointOp : NotDifferentiable {
  std::string name() const override { return "add_lamps_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{in[kRays].shape()}, {in[kRays + 1].shape()}};
  }
  void launch(Launch& l) const override {
    run(l, "add_lamps_adjoint", true, false, {l.inputs.back(), l.out(0), l.out(1)});
  }
};

struct AddLampsOp : Op {
  bool lobes;
  explicit AddLampsOp(bool l) : lobes(l) {}
  std::string name() const override { return "add_lamps"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check(in, lobes, "add_lamps");
    if (!(in.back().shape() == Shape{1, 3, 1, in[4].shape().w}))
      throw Error(ErrorKind::Failed, "one colour for each lamp is wanted", "add_lamps", in.back().shape().text(),
                  in[4].shape().text());
    return {{in[0].shape()}};
  }
  Slope slope(int input, int) const override {  // of the radiance, the lobes and the colours
    return input == 0 || input >= static_cast<int>(kRays) ? Slope::Adjoint : Slope::None;
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    const std::vector<Value>& in = node.inputs;
    const LampRays rays = rays_of(in, lobes);
    std::vector<Value> result(in.size());
    result.front() = g[0];
    result.back() = sum_to(weigh_lamps(g[0], rays, in[4]), in.back().shape());
    if (!lobes) return result;
    result[kRays] = node.graph->make<AddLampsAdjointOp>(inputs_of(g[0], rays, in[4], in.back()));
    result[kRays + 1] = result[kRays].node->value(1);
    return result;
  }
  void launch(Launch& l) const override { run(l, "add_lamps", lobes, false, {l.inputs.back(), l.out()}); }
  int overwrites() const override { return 0; }
};

}  // namespace

Value add_lamps(Value radiance, const LampRays& rays, Value places, Value colors) {
  return radiance.graph().make<AddLampsOp>(inputs_of(radiance, rays, places, colors), static_cast<bool>(rays.lobes));
}

Value weigh_lamps(Value weight, const LampRays& rays, Value places) {
  return weight.graph().make<WeighLampsOp>(inputs_of(weight, rays, places, {}), static_cast<bool>(rays.lobes));
}

}  // namespace clerestory
