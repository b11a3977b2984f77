#include "host/ops/nn/activation.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/activation.cl";

Defines defines(const Launch& l, Function f) {
  return row_defines(l.device, {{"FUNCTION", std::to_string(static_cast<int>(f))}});
}

struct ActivationAdjointOp : NotDifferentiable {  // dy, x -> dx
  Function function;
  explicit ActivationAdjointOp(Function f) : function(f) {}
  std::string name() const override { return "activation_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape(), Type::Real}}; }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const Blocks blocks = row_blocks(l.device, s.item());
    l.run_with(defines(l, function), kFile, "activate_adjoint", row_range(l.device, blocks.count, s.n), l.in(0),
               l.in(1), l.out(), static_cast<int>(s.item()), blocks.length);
  }
  int overwrites() const override { return 0; }
};

struct ActivationOp : Op {
  Function function;
  explicit ActivationOp(Function f) : function(f) {}
  std::string name() const override { return "activation"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape(), Type::Real}}; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    // These slopes can be read off the output, so that the input need not be kept.
    const bool from_output = function == Function::Relu || function == Function::Relu6;
    const Value from = from_output ? node.value() : node.inputs[0];
    return {from.graph().make<ActivationAdjointOp>({g[0], from}, function)};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const Blocks blocks = row_blocks(l.device, s.item());
    l.run_with(defines(l, function), kFile, "activate", row_range(l.device, blocks.count, s.n), l.in(0), l.out(),
               static_cast<int>(s.item()), blocks.length);
  }
  int overwrites() const override { return 0; }
};

}  // namespace

Value activate(Value x, Function function) { return x.graph().make<ActivationOp>({x}, function); }

}  // namespace clerestory
