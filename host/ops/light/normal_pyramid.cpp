#include "host/ops/light/normal_pyramid.hpp"

#include "host/ops/light/depth_pyramid.hpp"

namespace clerestory {
namespace {

struct NormalPyramidOp : NotDifferentiable {
  std::string name() const override { return "normal_pyramid"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    if (s.c != 3) throw Error(ErrorKind::Failed, "normals have three channels", "normal_pyramid", s.text());
    const PyramidLayout layout = pyramid_layout(s.w, s.h);
    return {{{s.n, 1, layout.level_rows, 2 * layout.stride}, Type::Int}};
  }

  Slope slope(int, int) const override { return Slope::Detached; }  // it steers where rays look

  void launch(Launch& l) const override { launch_pyramid(l, "light/normal_pyramid.cl", "normal_base", "normal_level"); }
};

}  // namespace

Value normal_pyramid(Value normal) { return normal.graph().make<NormalPyramidOp>({normal}); }

}  // namespace clerestory
