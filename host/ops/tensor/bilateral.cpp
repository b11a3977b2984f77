#include "host/ops/tensor/bilateral.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

struct BilateralOp : Op {  // x, small guide, guide -> y
  BilateralSpec spec;
  explicit BilateralOp(const BilateralSpec& s) : spec(s) {}
  std::string name() const override { return "bilateral"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape &x = in[0].shape(), &small = in[1].shape(), &guide = in[2].shape();
    const Shape expected{x.n, guide.c, x.h, x.w};
    if (!(small == expected) || guide.n != x.n)
      throw Error(ErrorKind::Failed, "the guides do not fit", "bilateral", small.text() + " and " + guide.text(), expected.text());
    if (spec.valid_height > x.h || spec.valid_width > x.w || spec.valid_height < 0 || spec.valid_width < 0)
      throw Error(ErrorKind::Failed, "the valid part is larger than the map", "bilateral",
                  fmt::format("{}x{}", spec.valid_height, spec.valid_width), x.text());
    return {{{x.n, x.c, guide.h, guide.w}, Type::Real}};
  }

  void launch(Launch& l) const override {
    const Shape &x = l.in(0).shape, &y = l.out().shape;
    const int valid_h = spec.valid_height ? spec.valid_height : x.h, valid_w = spec.valid_width ? spec.valid_width : x.w;
    l.run_with(row_defines(l.device), "tensor/bilateral.cl", "bilateral_upsample", row_range(l.device, y.h, y.n), l.in(0), l.in(1),
               l.in(2), l.out(), x.c, l.in(2).shape.c, x.h, x.w, valid_h, valid_w, y.h, y.w,
               Launch::Real{0.5 / (spec.space * spec.space)}, Launch::Real{0.5 / (spec.range * spec.range)});
  }
};

}  // namespace

Value bilateral_upsample(Value x, Value small_guide, Value guide, const BilateralSpec& spec) {
  return x.graph().make<BilateralOp>({x, small_guide, guide}, spec);
}

}  // namespace clerestory
