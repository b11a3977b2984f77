#include "host/ops/shade/light_guide.hpp"

namespace clerestory {
namespace {

// Inputs: depth, camera, normal, albedo, material, lamps.
struct LightGuideOp : Op {
  int pixels;
  explicit LightGuideOp(int p) : pixels(p) {}
  std::string name() const override { return "light_guide"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& d = in[0].shape();
    for (std::size_t k = 0; k < in.size(); ++k) {
      const Shape& s = in[k].shape();
      const bool map = s.n == d.n && s.h == d.h && s.w == d.w;
      const bool fits = k == 0   ? s.c == 1
                        : k == 1 ? s == Shape{d.n, 4, 1, 1}
                        : k <= 3 ? map && s.c == 3
                        : k == 4 ? map && s.c >= 2
                                 : (s.n == 1 || s.n == d.n) && s.c == 5 && s.h == 1;
      if (!fits) throw Error(ErrorKind::Failed, fmt::format("input {} does not fit", k), "light_guide", s.text());
    }
    return {{{pixels, kGuideHead + kGuideLobe * in[5].shape().w, 1, 1}, Type::Real}};
  }
  Slope slope(int, int) const override { return Slope::Detached; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value>) const override {
    return std::vector<Value>(node.inputs.size());
  }
  void launch(Launch& l) const override {
    const Shape &s = l.in(0).shape, &lamps = l.in(5).shape;
    const int first = l.chunk.first_pixel;
    const int count = l.chunk.pixels > 0 ? l.chunk.pixels : std::min(pixels, static_cast<int>(s.n * s.plane()));
    l.run("shade/light_guide.cl", "light_guide", Range::of(static_cast<std::size_t>(count)), l.inputs, l.out(), first,
          count, s.w, s.h, lamps.n, lamps.w);
  }
  Cost cost(const Node& node) const override {
    const Shape& rows = node.outputs[0].shape;
    const double lobes = static_cast<double>(rows.n) * (rows.c - kGuideHead) / kGuideLobe;
    return {150 * lobes, static_cast<double>(rows.count()) * 4};
  }
};

}  // namespace

Value light_guide(Value depth, Value camera, const Surfaces& sampling, Value lamps, int pixels) {
  return depth.graph().make<LightGuideOp>({depth, camera, sampling.normal, sampling.albedo, sampling.material, lamps},
                                          pixels);
}

}  // namespace clerestory
