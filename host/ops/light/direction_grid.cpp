#include "host/ops/light/direction_grid.hpp"

#include <cmath>

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/direction_grid.cl";

void check_normal(const Shape& normal, const char* op) {
  if (normal.n != 1 || normal.c != 3)
    throw Error(ErrorKind::Failed, "the normals of one picture are wanted", op, normal.text(), "1x3xHxW");
}

struct GridDirectionsOp : NotDifferentiable {
  int side;
  explicit GridDirectionsOp(int s) : side(s) {}
  std::string name() const override { return "grid_directions"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& normal = in[0].shape();
    check_normal(normal, "grid_directions");
    if (side < 4 || side % 4 != 0)
      throw Error(ErrorKind::Failed, "a grid of another side", "grid_directions", std::to_string(side),
                  "a multiple of 4");
    const int plane = static_cast<int>(normal.plane());
    return {{{1, 3, plane, side * side}}, {{1, 1, plane, side * side}, Type::Int}};
  }
  void launch(Launch& l) const override {
    const long plane = l.in(0).shape.plane();
    l.run(kFile, "grid_directions", Range::of2(static_cast<std::size_t>(side * side), static_cast<std::size_t>(plane)),
          l.in(0), l.out(0), l.out(1), static_cast<int>(plane), side);
  }
};

// Inputs: grid, normal, hit, direction, then list and count when `listed`.
struct LookUpGridOp : NotDifferentiable {
  bool listed;
  explicit LookUpGridOp(bool l) : listed(l) {}
  std::string name() const override { return "look_up_grid"; }
  static int side_of(const Shape& grid) { return static_cast<int>(std::lround(std::sqrt(grid.w))); }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[2], 1, "look_up_grid"), check_rays(in[3], 3, "look_up_grid");
    const Shape &grid = in[0].shape(), &normal = in[1].shape(), &hit = in[2].shape(), &direction = in[3].shape();
    check_normal(normal, "look_up_grid");
    const int side = side_of(grid);
    if (grid.n != 1 || grid.h != normal.plane() || side < 2 || side * side != grid.w)
      throw Error(ErrorKind::Failed, "a grid of another picture", "look_up_grid", grid.text(),
                  fmt::format("1xCx{}x(side^2)", normal.plane()));
    if (in[2].type() != Type::Int || hit.h != direction.h || hit.w != direction.w)
      throw Error(ErrorKind::Failed, "hit pixels (integers) and directions are of different rays", "look_up_grid",
                  hit.text(), direction.text());
    if (listed) check_list(in[4], in[5], hit, "look_up_grid");
    return {{{1, grid.c, hit.h, hit.w}}};
  }
  void launch(Launch& l) const override {
    clear_output(l);
    const Shape& grid = l.in(0).shape;
    const RayTile t = ray_tile(l, l.out().shape);
    const TensorView &list = l.in(listed ? 4 : 2), &count = l.in(listed ? 5 : 2);
    l.run(kFile, "look_up_grid", Range::of(static_cast<std::size_t>(l.out().shape.plane())), l.in(0), l.in(1), l.in(2),
          l.in(3), list, count, l.out(), t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity,
          t.sample_capacity, static_cast<int>(listed), grid.c, grid.h, side_of(grid));
  }
};

}  // namespace

GridRays grid_directions(Value normal, int side) {
  const Value direction = normal.graph().make<GridDirectionsOp>({normal}, side);
  return {direction, direction.node->value(1)};
}

Value look_up_grid(Value grid, Value normal, Value hit, Value direction, const RayList& list) {
  std::vector<Value> inputs{grid, normal, hit, direction};
  if (list) inputs.insert(inputs.end(), {list.rays, list.count});
  return grid.graph().make<LookUpGridOp>(std::move(inputs), static_cast<bool>(list));
}

}  // namespace clerestory
