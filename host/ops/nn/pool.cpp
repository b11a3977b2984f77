#include "host/ops/nn/pool.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/pool.cl";

Range per_plane(const Launch& l, const Shape& s) { return row_range(l.device, s.c, s.n); }

struct AveragePoolAdjointOp : NotDifferentiable {  // dy -> dx
  Shape input;
  explicit AveragePoolAdjointOp(Shape s) : input(s) {}
  std::string name() const override { return "average_pool_adjoint"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{input, Type::Real}}; }
  void launch(Launch& l) const override {
    l.run_with(row_defines(l.device), kFile, "average_pool_adjoint", per_plane(l, input), l.in(0), l.out(), input.h,
               input.w);
  }
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
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    l.run_with(row_defines(l.device), kFile, "average_pool", per_plane(l, s), l.in(0), l.out(), s.h, s.w);
  }
};

struct MaxPoolAdjointOp : NotDifferentiable {  // dy, which -> dx
  MaxPoolSpec spec;
  Shape input;
  MaxPoolAdjointOp(const MaxPoolSpec& m, Shape s) : spec(m), input(s) {}
  std::string name() const override { return "max_pool_adjoint"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{input, Type::Real}}; }
  void launch(Launch& l) const override {
    l.run_with(row_defines(l.device), kFile, "max_pool_adjoint", per_plane(l, input), l.in(0), l.in(1), l.out(),
               input.h, input.w, spec.window, spec.pad);
  }
};

struct MaxPoolOp : Op {  // x -> y, which
  MaxPoolSpec spec;
  explicit MaxPoolOp(const MaxPoolSpec& m) : spec(m) {}
  std::string name() const override { return "max_pool"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    if (spec.window < 1 || spec.window > 3)  // what the kernel holds in registers
      throw Error(ErrorKind::Failed, "no such window", "max_pool", std::to_string(spec.window), "1 to 3");
    if (s.h + 2 * spec.pad < spec.window || s.w + 2 * spec.pad < spec.window)
      throw Error(ErrorKind::Failed, "smaller than the window", "max_pool", s.text());
    const auto pooled = [&](int n) { return (n + 2 * spec.pad - spec.window) / 2 + 1; };
    const Shape out{s.n, s.c, pooled(s.h), pooled(s.w)};
    return {{out, Type::Real}, {out, Type::Int}};
  }
  Slope slope(int, int output) const override { return output == 0 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {g[0].graph().make<MaxPoolAdjointOp>({g[0], node.value(1)}, spec, node.in_shape(0))};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    l.run_with(row_defines(l.device), kFile, "max_pool", per_plane(l, s), l.in(0), l.out(0), l.out(1), s.h, s.w,
               spec.window, spec.pad);
  }
};

}  // namespace

Value average_pool(Value x) { return x.graph().make<AveragePoolOp>({x}); }
Value max_pool(Value x, const MaxPoolSpec& spec) { return x.graph().make<MaxPoolOp>({x}, spec); }

}  // namespace clerestory
