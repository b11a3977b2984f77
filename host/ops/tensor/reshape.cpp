#include "host/ops/tensor/reshape.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

struct ReshapeOp : Op {
  Shape shape;
  bool detached;
  ReshapeOp(Shape s, bool d) : shape(s), detached(d) {}
  std::string name() const override { return detached ? "detach" : "reshape"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    if (in[0].shape().count() != shape.count())
      throw Error(ErrorKind::Failed, "the number of elements differs", "reshape", in[0].shape().text(), shape.text());
    return {{shape, Type::Real}};
  }

  Slope slope(int, int) const override { return detached ? Slope::Detached : Slope::Adjoint; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {reshape(g[0], node.in_shape(0))};
  }

  void launch(Launch& l) const override {
    l.run("tensor/reshape.cl", "reshape_copy", Range::of(size(shape.count())), l.in(0), l.out(),
          static_cast<int>(shape.count()), static_cast<int>(l.in(0).shape.item()), static_cast<int>(shape.item()));
  }

  long view_offset(const Node&) const override { return 0; }
};

}  // namespace

Value reshape(Value x, const Shape& shape) {
  if (x.shape() == shape) return x;
  return x.graph().make<ReshapeOp>({x}, shape, false);
}

Value detach(Value x) { return x.graph().make<ReshapeOp>({x}, x.shape(), true); }

}  // namespace clerestory
