#include "host/ops/tensor/pad.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "tensor/pad.cl";

struct PadAdjointOp : NotDifferentiable {  // dy -> dx
  Padding p;
  explicit PadAdjointOp(const Padding& padding) : p(padding) {}
  std::string name() const override { return "pad_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    Shape s = in[0].shape();
    s.h -= p.top + p.bottom, s.w -= p.left + p.right;
    return {{s, Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape &out = l.in(0).shape, &s = l.out().shape;
    l.run_with(row_defines(l.device), kFile, "pad_replicate_adjoint", row_range(l.device, s.c, s.n), l.in(0), l.out(),
               s.h, s.w, out.h, out.w, p.top, p.left);
  }
};

struct PadOp : Op {
  Padding p;
  explicit PadOp(const Padding& padding) : p(padding) {}
  std::string name() const override { return "pad"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    if (p.top < 0 || p.bottom < 0 || p.left < 0 || p.right < 0)
      throw Error(ErrorKind::Failed, "padding is negative", "pad");
    Shape s = in[0].shape();
    s.h += p.top + p.bottom, s.w += p.left + p.right;
    return {{s, Type::Real}};
  }
  std::vector<Value> adjoint(const Node&, std::span<const Value> g) const override {
    return {g[0].graph().make<PadAdjointOp>({g[0]}, p)};
  }
  void launch(Launch& l) const override {
    const Shape &s = l.in(0).shape, &out = l.out().shape;
    l.run_with(row_defines(l.device), kFile, "pad_replicate", row_range(l.device, s.c, s.n), l.in(0), l.out(), s.h, s.w,
               out.h, out.w, p.top, p.left);
  }
};

}  // namespace

Value pad_replicate(Value x, const Padding& p) {
  if (p.top == 0 && p.bottom == 0 && p.left == 0 && p.right == 0) return x;
  return x.graph().make<PadOp>({x}, p);
}

}  // namespace clerestory
