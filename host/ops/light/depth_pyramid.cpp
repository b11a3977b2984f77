#include "host/ops/light/depth_pyramid.hpp"

#include <algorithm>

namespace clerestory {
namespace {

constexpr int kMostLevels = 8;  // a block of 128 pixels: larger ones are seldom free

int halved(int size, int level) { return (size + (1 << level) - 1) >> level; }

struct DepthPyramidOp : NotDifferentiable {
  std::string name() const override { return "depth_pyramid"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    if (s.c != 1) throw Error(ErrorKind::Failed, "depth has one channel", "depth_pyramid", s.text());
    const PyramidLayout layout = pyramid_layout(s.w, s.h);
    return {{{s.n, 1, layout.level_rows, layout.stride}, Type::Real}};
  }

  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    const PyramidLayout layout = pyramid_layout(s.w, s.h);
    const auto range = [&](int w, int h) {
      return Range{{static_cast<std::size_t>(w), static_cast<std::size_t>(h), static_cast<std::size_t>(s.n)},
                   {16, 1, 1}};
    };
    l.run("light/depth_pyramid.cl", "pyramid_base", range(layout.stride, layout.level_rows), l.in(0), l.out(), s.w, s.h,
          layout.stride, layout.level_rows);
    for (int level = 1; level < layout.levels; ++level) {
      const int w = halved(s.w, level), h = halved(s.h, level);
      l.run("light/depth_pyramid.cl", "pyramid_level", range(w, h), l.out(), layout.row(level - 1),
            halved(s.w, level - 1), halved(s.h, level - 1), layout.row(level), w, h, layout.stride);
    }
  }
};

}  // namespace

PyramidLayout pyramid_layout(int w, int h) {
  PyramidLayout layout;
  int padded = 1;
  while (padded < h) padded *= 2;
  layout.level_rows = 2 * padded;
  layout.stride = 16 * ((w + 15) / 16 | 1);
  // Level l begins at row level_rows - (level_rows >> l) and needs ceil(h / 2^l) rows, so padded >= 2^l must hold.
  layout.levels = 1;
  while (layout.levels < kMostLevels && (1 << layout.levels) <= padded && (1 << (layout.levels - 1)) < std::max(w, h))
    ++layout.levels;
  return layout;
}

Value depth_pyramid(Value depth) { return depth.graph().make<DepthPyramidOp>({depth}); }

}  // namespace clerestory
