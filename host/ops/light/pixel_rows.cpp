#include "host/ops/light/pixel_rows.hpp"

namespace clerestory {
namespace {

struct PixelRowsOp : NotDifferentiable {
  std::string name() const override { return "pixel_rows"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape &surface = in[0].shape(), &features = in[1].shape();
    if (surface.n != 1 || features.n != 1 || features.c != surface.c)
      throw Error(ErrorKind::Failed, "the maps of one picture have the same channels", "pixel_rows",
                  fmt::format("{} and {}", surface.text(), features.text()), "1xCxHxW and 1xCxH'xW'");
    if (surface.count() > 0x7fffffff)
      throw Error(ErrorKind::Failed, "rows of more numbers than an index holds", "pixel_rows", surface.text(),
                  "at most 2^31 - 1");
    return {{{1, 1, static_cast<int>(surface.plane()), surface.c}, Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape &surface = l.in(0).shape, &features = l.in(1).shape;
    l.run("light/pixel_rows.cl", "pixel_rows",
          Range::of2(static_cast<std::size_t>(surface.w), static_cast<std::size_t>(surface.h)), l.in(0), l.in(1),
          l.out(), surface.c, surface.w, surface.h, features.w, features.h);
  }
};

}  // namespace

Value pixel_rows(Value surface, Value features) { return surface.graph().make<PixelRowsOp>({surface, features}); }

}  // namespace clerestory
