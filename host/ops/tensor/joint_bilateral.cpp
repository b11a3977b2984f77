#include "host/ops/tensor/joint_bilateral.hpp"

namespace clerestory {
namespace {

double falloff(double deviation) { return 1 / (2 * deviation * deviation); }

struct JointBilateralOp : NotDifferentiable {
  JointBilateral by;
  explicit JointBilateralOp(const JointBilateral& b) : by(b) {}
  std::string name() const override { return "joint_bilateral"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape &x = in[0].shape(), &low = in[1].shape(), &guide = in[2].shape();
    if (low.n != x.n || low.c != 3 || low.h > x.h || low.w > x.w || guide.n != x.n || guide.c != 3)
      throw Error(ErrorKind::Failed, "maps and guides do not fit", name(),
                  x.text() + ", " + low.text() + ", " + guide.text());
    return {{{x.n, x.c, guide.h, guide.w}, Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape &x = l.in(0).shape, &low = l.in(1).shape, &y = l.out().shape;
    const auto run = [&](const char* kernel, auto... more) {
      l.run("tensor/joint_bilateral.cl", kernel,
            Range::of2(static_cast<std::size_t>(y.plane()), static_cast<std::size_t>(y.n)), l.in(0), l.in(1), l.in(2),
            l.out(), x.c, x.h, x.w, low.h, low.w, y.h, y.w, Launch::Real{falloff(by.sigma)},
            Launch::Real{falloff(by.reach)}, more...);
    };
    if (by.alike > 0)
      run("joint_bilateral_mode", Launch::Real{falloff(by.alike)});
    else
      run("joint_bilateral");
  }
  Cost cost(const Node& node) const override {
    const Shape& y = node.outputs[0].shape;
    const double pixels = static_cast<double>(y.n) * static_cast<double>(y.plane());
    const double agreement = by.alike > 0 ? 16 * (4 + 3 * y.c) : 0;
    return {pixels * 16 * (15 + 2 * y.c + agreement), 4 * pixels * (3 + y.c)};
  }
};

}  // namespace

Value joint_bilateral(Value x, Value guide_low, Value guide, const JointBilateral& by) {
  return x.graph().make<JointBilateralOp>({x, guide_low, guide}, by);
}

}  // namespace clerestory
