#include "host/ops/nn/unit_vector.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/unit_vector.cl";

Range per_pixel(const Shape& s) { return Range::of2(size(s.plane()), size(s.n)); }

struct UnitVectorAdjointOp : NotDifferentiable {  // dn, t -> dt
  std::string name() const override { return "unit_vector_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[1].shape(), Type::Real}}; }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    l.run(kFile, "unit_vector_adjoint", per_pixel(s), l.in(0), l.in(1), l.out(), static_cast<int>(s.plane()));
  }
};

struct UnitVectorOp : Op {
  std::string name() const override { return "unit_vector"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    if (in[0].shape().c != 3)
      throw Error(ErrorKind::Failed, "vectors have three channels", "unit_vector", in[0].shape().text());
    return {{in[0].shape(), Type::Real}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {g[0].graph().make<UnitVectorAdjointOp>({g[0], node.inputs[0]})};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    l.run(kFile, "unit_vector", per_pixel(s), l.in(0), l.out(), static_cast<int>(s.plane()));
  }
};

}  // namespace

Value unit_vector(Value t) { return t.graph().make<UnitVectorOp>({t}); }

}  // namespace clerestory
