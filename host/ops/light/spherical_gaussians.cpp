#include "host/ops/light/spherical_gaussians.hpp"

#include "host/ops/light/gather_rays.hpp"
#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/spherical_gaussians.cl";

void check_lobes(const Gaussians& g, int h, int w, const char* op) {
  const int k = g.lobes();
  if (k < 1 || !(g.sharpness.shape() == Shape{1, k, h, w}) || !(g.axis.shape() == Shape{1, 3 * k, h, w}) ||
      !(g.weight.shape() == g.axis.shape()))
    throw Error(ErrorKind::Failed, "axis, sharpness and weight are not of the same lobes", op,
                fmt::format("{}, {}, {}", g.axis.shape().text(), g.sharpness.shape().text(), g.weight.shape().text()),
                fmt::format("1x(3 K)x{0}x{1}, 1xKx{0}x{1}, 1x(3 K)x{0}x{1}", h, w));
}

/// Runs `kernel` over rows of rays, or over the lobes of each: inputs axis, sharpness, weight, direction, what more
/// there is, then outputs.
void run(Launch& l, const char* kernel, bool of_lobes) {
  const Shape &rays = l.in(3).shape, &lobes = l.in(1).shape;
  const RayTile t = ray_tile(l, rays);
  Defines defines = row_defines(l.device);
  if (lobes.w == 1 && rays.w != 1) defines["ROW_LOBES"] = "1";
  l.run_with(defines, kFile, kernel, row_range(l.device, t.pixels, of_lobes ? lobes.c : 1), l.inputs, l.outputs,
             t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, lobes.c);
}

// Inputs of both adjoints: axis, sharpness, weight, direction, gradient.
struct ToDirectionOp : NotDifferentiable {
  std::string name() const override { return "spherical_gaussians_to_direction"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[3].shape()}}; }
  void launch(Launch& l) const override { run(l, "spherical_gaussians_to_direction", false); }
};

struct ToLobesOp : NotDifferentiable {
  std::string name() const override { return "spherical_gaussians_to_lobes"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{in[0].shape()}, {in[1].shape()}, {in[2].shape()}};
  }
  void launch(Launch& l) const override { run(l, "spherical_gaussians_to_lobes", true); }
};

struct SphericalGaussiansOp : Op {
  std::string name() const override { return "spherical_gaussians"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[3], 3, "spherical_gaussians");
    const Shape& rays = in[3].shape();
    check_lobes({in[0], in[1], in[2]}, rays.h, in[1].shape().w == 1 ? 1 : rays.w, "spherical_gaussians");
    return {{rays}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return adjoint_for({true, true, true, true}, node, g);
  }
  std::vector<Value> adjoint_for(const std::vector<bool>& wanted, const Node& node,
                                 std::span<const Value> g) const override {
    std::vector<Value> in = node.inputs, result(4);
    in.push_back(g[0]);
    if (wanted[0] || wanted[1] || wanted[2]) {
      const Value first = node.graph->make<ToLobesOp>(in);
      for (int i = 0; i < 3; ++i) result[static_cast<std::size_t>(i)] = first.node->value(i);
    }
    if (wanted[3]) result[3] = node.graph->make<ToDirectionOp>(in);
    return result;
  }
  void launch(Launch& l) const override { run(l, "spherical_gaussians", false); }
  Cost cost(const Node& node) const override {  // an exp counts as ten
    Cost cost = Op::cost(node);
    cost.flops = 28.0 * node.in_shape(1).c * static_cast<double>(node.in_shape(3).plane());
    return cost;
  }
};

void check_camera(const Value& camera, const char* op) {
  if (!(camera.shape() == Shape{1, 4, 1, 1}))
    throw Error(ErrorKind::Failed, "one camera is wanted", op, camera.shape().text(), "1x4x1x1");
}

struct PointCellsOp : NotDifferentiable {  // points, camera
  Shape picture, grid;
  PointCellsOp(const Shape& p, const Shape& g) : picture(p), grid(g) {}
  std::string name() const override { return "point_cells"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 3, "point_cells"), check_camera(in[1], "point_cells");
    const Shape& points = in[0].shape();
    return {{{1, 1, points.h, points.w}, Type::Int}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run(kFile, "point_cells", ray_range(t), l.in(0), l.in(1), l.out(), t.first_pixel, t.pixels, t.first_sample,
          t.samples, t.pixel_capacity, t.sample_capacity, grid.w, grid.h, picture.w, picture.h);
  }
};

struct GaussiansOfPointsOp : NotDifferentiable {  // axis, sharpness, weight, camera, points, direction
  Shape picture;
  explicit GaussiansOfPointsOp(const Shape& p) : picture(p) {}
  std::string name() const override { return "gaussians_of_points"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[5], 3, "gaussians_of_points");
    check_points(in[4], in[5], "gaussians_of_points");
    check_lobes({in[0], in[1], in[2]}, in[1].shape().h, in[1].shape().w, "gaussians_of_points");
    check_camera(in[3], "gaussians_of_points");
    return {{in[5].shape()}};
  }
  void launch(Launch& l) const override {
    const Shape &maps = l.in(1).shape, &rays = l.in(5).shape;
    const RayTile t = ray_tile(l, rays);
    Defines defines = row_defines(l.device);
    if (l.in(4).shape.w == 1 && rays.w != 1) defines["ROW_STARTS"] = "1";
    l.run_with(defines, kFile, "gaussians_of_points", row_range(l.device, t.pixels), l.inputs, l.out(), t.first_pixel,
               t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, maps.c, maps.w, maps.h,
               picture.w, picture.h);
  }
};

struct TurnGaussiansOp : Op {  // axis or its gradient, normal
  bool back;
  explicit TurnGaussiansOp(bool b) : back(b) {}
  std::string name() const override { return "turn_gaussians"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape &axis = in[0].shape(), &normal = in[1].shape();
    if (axis.c % 3 != 0 || !(normal == Shape{axis.n, 3, axis.h, axis.w}))
      throw Error(ErrorKind::Failed, "axes and normals are of different pixels", "turn_gaussians", axis.text(),
                  fmt::format("{}x(3 K)x{}x{}", normal.n, normal.h, normal.w));
    return {{axis}};
  }
  Slope slope(int input, int) const override { return input == 0 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {node.graph->make<TurnGaussiansOp>({g[0], node.inputs[1]}, !back), {}};
  }
  void launch(Launch& l) const override {
    const Shape& axis = l.in(0).shape;
    l.run(kFile, "turn_gaussians", Range::of2(size(axis.plane()), size(axis.n)), l.in(0), l.in(1), l.out(), axis.c / 3,
          static_cast<int>(axis.plane()), static_cast<int>(back));
  }
};

}  // namespace

Value spherical_gaussians(const Gaussians& g, Value direction) {
  return direction.graph().make<SphericalGaussiansOp>({g.axis, g.sharpness, g.weight, direction});
}

Value gaussians_of_points(const Gaussians& maps, Value camera, const Shape& picture, Value points, Value direction) {
  return direction.graph().make<GaussiansOfPointsOp>(
      {maps.axis, maps.sharpness, maps.weight, camera, points, direction}, picture);
}

Value point_cells(Value points, Value camera, const Shape& picture, const Shape& grid) {
  return points.graph().make<PointCellsOp>({points, camera}, picture, grid);
}

Gaussians gather_gaussians(const Gaussians& maps, Value cells) {
  return {gather_rays(maps.axis, cells), gather_rays(maps.sharpness, cells), gather_rays(maps.weight, cells)};
}

Value turn_to_camera(Value axis, Value normal) { return axis.graph().make<TurnGaussiansOp>({axis, normal}, false); }

}  // namespace clerestory
