#include "host/ops/tensor/reciprocal.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "tensor/reciprocal.cl";

Defines defines(const Launch& l, bool root) { return row_defines(l.device, {{"ROOT", root ? "1" : "0"}}); }

struct ReciprocalAdjointOp : NotDifferentiable {  // dy, y -> dx
  bool root;
  explicit ReciprocalAdjointOp(bool r) : root(r) {}
  std::string name() const override { return "reciprocal_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape(), Type::Real}}; }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const Blocks blocks = row_blocks(l.device, s.item());
    l.run_with(defines(l, root), kFile, "reciprocal_adjoint", row_range(l.device, blocks.count, s.n), l.in(0), l.in(1),
               l.out(), static_cast<int>(s.item()), blocks.length);
  }
  int overwrites() const override { return 0; }
};

struct ReciprocalOp : Op {
  bool root;
  explicit ReciprocalOp(bool r) : root(r) {}
  std::string name() const override { return root ? "reciprocal_root" : "reciprocal"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape(), Type::Real}}; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {node.graph->make<ReciprocalAdjointOp>({g[0], node.value()}, root)};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const Blocks blocks = row_blocks(l.device, s.item());
    l.run_with(defines(l, root), kFile, "reciprocal", row_range(l.device, blocks.count, s.n), l.in(0), l.out(),
               static_cast<int>(s.item()), blocks.length);
  }
  int overwrites() const override { return 0; }
};

}  // namespace

Value reciprocal(Value x) { return x.graph().make<ReciprocalOp>({x}, false); }
Value reciprocal_root(Value x) { return x.graph().make<ReciprocalOp>({x}, true); }

}  // namespace clerestory
