#include "host/ops/shade/repaint.hpp"

#include <array>

#include "host/ops/shade/pictures.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "shade/repaint.cl";

struct RepaintOp : NotDifferentiable {
  std::string name() const override { return "repaint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_pictures(in, std::array{3, 3, 3, 3, 3, 1, 1, 3, 3, 3}, name());
    return {{in[0].shape()}};
  }
  void launch(Launch& l) const override {
    const int plane = static_cast<int>(l.out().shape.plane());
    l.run(kFile, "repaint", Range::of(static_cast<std::size_t>(plane)), l.in(0), l.in(1), l.in(2), l.in(3), l.in(4),
          l.in(5), l.in(6), l.in(7), l.in(8), l.in(9), l.out(), plane);
  }
};

struct RepaintLayerShareOp : NotDifferentiable {
  std::string name() const override { return "repaint_layer_share"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_pictures(in, std::array{3, 3, 3, 3, 1}, name());
    return {{Shape{1, 1, in[0].shape().h, in[0].shape().w}}};
  }
  void launch(Launch& l) const override {
    const int plane = static_cast<int>(l.out().shape.plane());
    l.run(kFile, "repaint_layer_share", Range::of(static_cast<std::size_t>(plane)), l.in(0), l.in(1), l.in(2), l.in(3),
          l.in(4), l.out(), plane);
  }
};

}  // namespace

Value repaint(Value photo, const Repainted& m, Value shown, const RepaintLayers& layers) {
  return photo.graph().make<RepaintOp>({photo, m.old_albedo, m.old_material, m.albedo, m.material, m.emitted, shown,
                                        layers.old_specular, layers.specular, layers.whole});
}

Value repaint_layer_share(const Repainted& m) {
  return m.albedo.graph().make<RepaintLayerShareOp>({m.old_albedo, m.old_material, m.albedo, m.material, m.emitted});
}

}  // namespace clerestory
