#include "host/ops/light/select_rays.hpp"

#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/select_rays.cl";
constexpr int kBlock = 1024;  // rays that one work-group counts and places: a multiple of its work-items

struct SelectRaysOp : NotDifferentiable {
  LightPart part;
  double epsilon;
  SelectRaysOp(LightPart p, double e) : part(p), epsilon(e) {}
  std::string name() const override { return "select_rays"; }

  static int blocks(const Shape& rays) { return static_cast<int>((rays.plane() + kBlock - 1) / kBlock); }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 1, "select_rays"), check_rays(in[1], 1, "select_rays"), check_rays(in[2], 3, "select_rays");
    const Shape &u = in[0].shape(), &hit = in[1].shape(), &direction = in[2].shape();
    if (!(hit == u) || in[1].type() != Type::Int || direction.h != u.h || direction.w != u.w)
      throw Error(ErrorKind::Failed, "u, hit pixels (integers) and directions are of different rays", "select_rays",
                  hit.text() + " and " + direction.text(), u.text() + " and three channels of the same rays");
    if (u.plane() > 0x7fffffff - kBlock)
      throw Error(ErrorKind::Failed, "more rays than integers number", "select_rays", u.text());
    return {{u, Type::Int}, {{1, 1, 1, 1}, Type::Int}};
  }

  std::size_t workspace(const Node& node) const override {  // integers, never wider than the plan's reals
    return static_cast<std::size_t>(blocks(node.in_shape(0)));
  }

  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.in(0).shape);
    const int count = blocks(l.in(0).shape), out_of_view = part == LightPart::OutOfView;
    TensorView counts = l.workspace;
    counts.offset *= real_size(l.precision) / sizeof(std::int32_t);
    const Defines defines = row_defines(l.device);
    const Range each_block = row_range(l.device, count);
    const Launch::Real least{epsilon};
    l.run_with(defines, kFile, "count_wanted", each_block, l.in(0), l.in(1), l.in(2), t.first_pixel, t.pixels,
               t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, out_of_view, least, kBlock, counts);
    l.run_with(defines, kFile, "begin_blocks", row_range(l.device, 1), counts, count, l.out(1));
    l.run_with(defines, kFile, "place_wanted", each_block, l.in(0), l.in(1), l.in(2), t.first_pixel, t.pixels,
               t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, out_of_view, least, kBlock, counts,
               l.out(1), l.out(0));
  }
};

}  // namespace

RayList select_rays(Value u, Value hit, Value direction, LightPart part, double epsilon) {
  if (!((epsilon >= 0 && epsilon < 1) || epsilon == kEveryRay))
    throw Error(ErrorKind::Failed, "the share that may be left out is no share", "select_rays",
                fmt::format("{}", epsilon), "at least 0 and below 1");
  const Value rays = u.graph().make<SelectRaysOp>({u, hit, direction}, part, epsilon);
  return {rays, rays.node->value(1)};
}

void check_list(const Value& list, const Value& count, const Shape& rays, const char* op) {
  if (list.type() != Type::Int || list.shape().count() != rays.plane() || count.type() != Type::Int)
    throw Error(ErrorKind::Failed, "the list is of other rays", op, list.shape().text(), rays.text());
}

void clear_output(Launch& l) {
  const TensorView& y = l.out();
  const std::size_t real = real_size(l.precision);
  l.device.zero(y.buffer, size(y.shape.count()) * real, y.offset * real);
}

}  // namespace clerestory
