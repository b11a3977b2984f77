#include "host/ops/light/facing_pyramid.hpp"

#include "host/ops/light/depth_pyramid.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/facing_pyramid.cl";

struct FacingPyramidOp : NotDifferentiable {
  std::string name() const override { return "facing_pyramid"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    if (s.c != 1 || !(in[1].shape() == Shape{s.n, 3, s.h, s.w}))
      throw Error(ErrorKind::Failed, "a depth map and its normals are wanted", "facing_pyramid",
                  s.text() + " and " + in[1].shape().text());
    const PyramidLayout layout = pyramid_layout(s.w, s.h);
    return {{{s.n, 1, layout.level_rows, layout.stride}, Type::Int}};
  }

  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    const PyramidLayout layout = pyramid_layout(s.w, s.h);
    const TensorView& y = l.out();  // what lies between the levels is 0
    l.device.zero(y.buffer, sizeof(std::int32_t) * static_cast<std::size_t>(y.shape.count()),
                  sizeof(std::int32_t) * y.offset);
    for (int level = 0; level < layout.levels; ++level) {
      const int w = halved(s.w, level), h = halved(s.h, level);
      l.run(kFile, "facing_level", pyramid_range(w, h, s.n), l.in(0), l.in(1), y, level, layout.row(level), w, h, s.w,
            s.h, layout.stride);
    }
  }
};

}  // namespace

Value facing_pyramid(Value depth, Value normal) { return depth.graph().make<FacingPyramidOp>({depth, normal}); }

}  // namespace clerestory
