#include "host/ops/nn/pool.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/pool.cl";

template <class... Tensors>
void run(Launch& l, const char* kernel, const Shape& input, const Tensors&... tensors) {
  l.run_with(row_defines(l.device), kFile, kernel, row_range(l.device, input.c, input.n), tensors..., input.h, input.w);
}

struct AveragePoolAdjointOp : Op {  // dy -> dx
  Shape input;
  explicit AveragePoolAdjointOp(Shape s) : input(s) {}
  std::string name() const override { return "average_pool_adjoint"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{input, Type::Real}}; }
  void launch(Launch& l) const override { run(l, "average_pool_adjoint", input, l.in(0), l.out()); }
};

struct AveragePoolOp : Op {
  std::string name() const override { return "average_pool"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    if (s.h < 2 || s.w < 2) throw Error(ErrorKind::Failed, "too small to halve", "average_pool", s.text());
    return {{{s.n, s.c, s.h / 2, s.w / 2}, Type::Real}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {g[0].graph().make<AveragePoolAdjointOp>({g[0]}, node.in_shape(0))};
  }
  void launch(Launch& l) const override { run(l, "average_pool", l.in(0).shape, l.in(0), l.out()); }
};

struct MaxPoolAdjointOp : Op {  // dy, which -> dx
  Shape input;
  explicit MaxPoolAdjointOp(Shape s) : input(s) {}
  std::string name() const override { return "max_pool_adjoint"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{input, Type::Real}}; }
  void launch(Launch& l) const override { run(l, "max_pool_adjoint", input, l.in(0), l.in(1), l.out()); }
};

struct MaxPoolOp : Op {
  std::string name() const override { return "max_pool"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    const Shape out{s.n, s.c, (s.h - 1) / 2 + 1, (s.w - 1) / 2 + 1};
    return {{out, Type::Real}, {out, Type::Int}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {g[0].graph().make<MaxPoolAdjointOp>({g[0], node.value(1)}, node.in_shape(0))};
  }
  void launch(Launch& l) const override { run(l, "max_pool", l.in(0).shape, l.in(0), l.out(0), l.out(1)); }
};

}  // namespace

Value average_pool(Value x) { return x.graph().make<AveragePoolOp>({x}); }
Value max_pool(Value x) { return x.graph().make<MaxPoolOp>({x}); }

}  // namespace clerestory
