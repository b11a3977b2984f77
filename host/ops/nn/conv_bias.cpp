#include "host/ops/nn/conv_bias.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

/// db from dy.
struct ConvBiasOp : NotDifferentiable {
  std::string name() const override { return "conv_bias"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{Shape{1, in[0].shape().c, 1, 1}, Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    l.run_with(row_defines(l.device), "nn/conv_bias.cl", "conv_bias_gradient", row_range(l.device, s.c), l.in(0),
               l.out(), s.n, static_cast<int>(s.plane()));
  }
};

}  // namespace

Value conv_bias_gradient(Value dy) { return dy.graph().make<ConvBiasOp>({dy}); }

}  // namespace clerestory
