#include "host/ops/light/ask_shells.hpp"

#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/ask_shells.cl";

// Inputs: shells, points, directions, range, radii, then list and count when `listed`.
struct AskShellsOp : NotDifferentiable {
  bool listed;
  explicit AskShellsOp(bool l) : listed(l) {}
  std::string name() const override { return "ask_shells"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[2], 3, "ask_shells"), check_points(in[1], in[2], "ask_shells");
    const Shape &shells = in[0].shape(), &rays = in[2].shape();
    if (shells.c != 4 || shells.h < 2 || shells.w < 2)
      throw Error(ErrorKind::Failed, "these are no shells", "ask_shells", shells.text(), "Kx4xROWSxCOLUMNS");
    if (!(in[3].shape() == Shape{1, 3, 1, 1}))
      throw Error(ErrorKind::Failed, "shells are of one picture, so is its range of depths", "ask_shells",
                  in[3].shape().text(), "1x3x1x1");
    if (listed) check_list(in[5], in[6], rays, "ask_shells");
    return {{{1, 3, rays.h, rays.w}, Type::Real}};
  }

  std::size_t workspace(const Node& node) const override {
    const Shape& shells = node.in_shape(0);
    return size(4L * shells.n * shells.h * (shells.w + 1));
  }

  void launch(Launch& l) const override {
    const Shape& shells = l.in(0).shape;
    l.run_with(row_defines(l.device), kFile, "pack_shells",
               Range::of2(size(shells.w + 1), size(static_cast<long>(shells.n) * shells.h)), l.in(0), l.workspace,
               shells.n, shells.h, shells.w);
    const TensorView& y = l.out();
    clear_output(l);
    const RayTile t = ray_tile(l, y.shape);
    const TensorView &list = l.in(listed ? 5 : 0), &count = l.in(listed ? 6 : 0);
    l.run_with(row_defines(l.device), kFile, "ask_shells", lane_range(l.device, y.shape.plane()), l.workspace, l.in(1),
               l.in(2), l.in(3), l.in(4), list, count, y, t.first_pixel, t.pixels, t.first_sample, t.samples,
               t.pixel_capacity, t.sample_capacity, static_cast<int>(listed),
               static_cast<int>(l.in(1).shape.w != y.shape.w), shells.n, shells.h, shells.w);
  }
};

}  // namespace

Value ask_shells(Value shells, Value points, Value directions, Value range, const RayList& list,
                 const std::vector<double>& radii) {
  const int count = shells.shape().n;
  if (static_cast<int>(radii.size()) != count)
    throw Error(ErrorKind::Failed, "another number of radii than of shells", "ask_shells", std::to_string(radii.size()),
                std::to_string(count));
  std::vector<Value> inputs{shells, points, directions, range,
                            shells.graph().constant(Tensor({count, 1, 1, 1}, radii))};
  if (list) inputs.insert(inputs.end(), {list.rays, list.count});
  return points.graph().make<AskShellsOp>(std::move(inputs), static_cast<bool>(list));
}

}  // namespace clerestory
