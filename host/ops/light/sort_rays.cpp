#include "host/ops/light/sort_rays.hpp"

#include <algorithm>

#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/sort_rays.cl";
constexpr int kDigitBits = 8, kDigits = 1 << kDigitBits;
constexpr int kBlock = 1024;  // rays that one work-group orders by itself

struct SortRaysOp : NotDifferentiable {
  Shape map;
  explicit SortRaysOp(const Shape& m) : map(m) {}
  std::string name() const override { return "sort_rays"; }

  int keys() const { return static_cast<int>(map.n * map.plane()); }
  static int blocks(int rays) { return (rays + kBlock - 1) / kBlock; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 1, "sort_rays");
    if (in[0].type() != Type::Int || in[0].shape().count() > 0x7fffffff)
      throw Error(ErrorKind::Failed, "pixel indices of at most 2^31 rays are wanted", "sort_rays",
                  in[0].shape().text());
    return {{in[0].shape(), Type::Int}, {{1, 1, 1, keys() + 1}, Type::Int}};
  }

  /// Two sets of keys, one of orders, counts of digits: integers, never wider than the plan's reals.
  std::size_t workspace(const Node& node) const override {
    const int rays = static_cast<int>(node.in_shape(0).count());
    return 3 * static_cast<std::size_t>(rays) +
           static_cast<std::size_t>(kDigits) * static_cast<std::size_t>(blocks(rays));
  }

  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.in(0).shape);
    const int rays = static_cast<int>(l.in(0).shape.count()), count = blocks(rays);
    const auto part = [&](int which, int length) {
      TensorView view = l.workspace;
      view.offset = view.offset * (real_size(l.precision) / sizeof(std::int32_t)) +
                    static_cast<std::uint64_t>(which) * static_cast<std::uint64_t>(rays);
      view.shape = {1, 1, 1, length}, view.type = Type::Int;
      return view;
    };
    int passes = 1;
    while (static_cast<std::int64_t>(keys()) >> (kDigitBits * passes) > 0) ++passes;
    TensorView key = part(0, rays), other_key = part(1, rays), order = part(2, rays), other_order = l.out(0);
    const TensorView counts = part(3, kDigits * count);
    if (passes % 2 == 0) std::swap(order, other_order);  // the last pass writes the output
    RayTile all = t;
    all.pixels = t.pixel_capacity;  // rows beyond the chunk are misses
    const Defines defines = row_defines(l.device);
    l.run_with(defines, kFile, "ray_keys", ray_range(all), l.in(0), key, order, t.first_pixel, t.pixels, t.first_sample,
               t.samples, t.pixel_capacity, t.sample_capacity, static_cast<int>(map.plane()), keys());
    const Range each_block = row_range(l.device, count);
    for (int pass = 0; pass < passes; ++pass) {
      const int shift = kDigitBits * pass;
      l.run_with(defines, kFile, "count_digits", each_block, key, counts, rays, kBlock, count, shift);
      l.run_with(defines, kFile, "begin_digits", row_range(l.device, 1), counts, kDigits * count);
      l.run_with(defines, kFile, "place_by_digit", each_block, key, order, counts, other_key, other_order, rays, kBlock,
                 count, shift);
      std::swap(key, other_key), std::swap(order, other_order);
    }
    l.run_with(defines, kFile, "segment_starts", Range::of(static_cast<std::size_t>(keys()) + 1), key, l.out(1), rays,
               keys());
  }
};

}  // namespace

SortedRays sort_rays(Value hit, const Shape& map) {
  const Value order = hit.graph().make<SortRaysOp>({hit}, map);
  return {order, order.node->value(1)};
}

}  // namespace clerestory
