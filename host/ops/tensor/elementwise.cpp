#include "host/ops/tensor/elementwise.hpp"

#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "tensor/elementwise.cl";

bool broadcasts(const Shape& b, const Shape& a) {
  return (b.n == a.n || b.n == 1) && (b.c == a.c || b.c == 1) && ((b.h == a.h && b.w == a.w) || b.plane() == 1);
}

void check_broadcast(const Shape& b, const Shape& a, const std::string& op) {
  if (!broadcasts(b, a))
    throw Error(ErrorKind::Failed, "shapes do not fit", op, b.text(), a.text() + " or 1 along some axes");
}

/// How rows walk `y` and the broadcast `b`.
struct Walk {
  int plane, b_n, b_c, b_i, block;
  Range range;

  Walk(const Device& device, const Shape& y, const Shape& b) {
    const bool flat = b == y;
    plane = static_cast<int>(flat ? y.item() : y.plane());
    const Blocks blocks = row_blocks(device, plane);
    b_n = b.n > 1, b_c = b.c > 1 ? static_cast<int>(b.plane()) : 0, b_i = flat || b.plane() > 1;
    block = blocks.length;
    range = row_range(device, blocks.count, flat ? 1 : y.c, y.n);
  }
};

struct ExpandOp : Op {
  Shape shape;
  double factor;
  ExpandOp(Shape s, double f) : shape(s), factor(f) {}
  std::string name() const override { return "expand"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_broadcast(in[0].shape(), shape, name());
    return {{shape, Type::Real}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {sum_to(g[0], node.in_shape(0), factor)};
  }
  void launch(Launch& l) const override {
    const Walk w(l.device, shape, l.in(0).shape);
    l.run_with(row_defines(l.device), kFile, "expand", w.range, l.in(0), l.out(), Launch::Real{factor}, w.plane, w.b_n,
               w.b_c, w.b_i, w.block);
  }
};

/// Gradient of a broadcast operand: summed back to its shape.
Value back_to(Value g, const Shape& shape, double factor = 1) {
  if (g.shape() == shape) return factor == 1 ? g : scale(g, factor);
  return sum_to(g, shape, factor);
}

struct AddOp : Op {
  double weight;
  explicit AddOp(double w) : weight(w) {}
  std::string name() const override { return "add"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_broadcast(in[1].shape(), in[0].shape(), name());
    return {{in[0].shape(), Type::Real}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {g[0], back_to(g[0], node.in_shape(1), weight)};
  }
  void launch(Launch& l) const override {
    const Walk w(l.device, l.out().shape, l.in(1).shape);
    l.run_with(row_defines(l.device), kFile, "add_scaled", w.range, l.in(0), l.in(1), l.out(), Launch::Real{weight},
               w.plane, w.b_n, w.b_c, w.b_i, w.block);
  }
  int overwrites() const override { return 0; }
};

struct MultiplyOp : Op {
  std::string name() const override { return "multiply"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_broadcast(in[1].shape(), in[0].shape(), name());
    return {{in[0].shape(), Type::Real}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    const Value a = node.inputs[0], b = node.inputs[1];
    return {multiply(g[0], b), back_to(multiply(g[0], a), b.shape())};
  }
  void launch(Launch& l) const override {
    const Walk w(l.device, l.out().shape, l.in(1).shape);
    l.run_with(row_defines(l.device), kFile, "multiply", w.range, l.in(0), l.in(1), l.out(), w.plane, w.b_n, w.b_c,
               w.b_i, w.block);
  }
  int overwrites() const override { return 0; }
};

struct AffineOp : Op {
  double factor, offset;
  AffineOp(double f, double o) : factor(f), offset(o) {}
  std::string name() const override { return "affine"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape(), Type::Real}}; }
  std::vector<Value> adjoint(const Node&, std::span<const Value> g) const override { return {scale(g[0], factor)}; }
  void launch(Launch& l) const override {
    const Walk w(l.device, l.out().shape, l.out().shape);
    l.run_with(row_defines(l.device), kFile, "affine", w.range, l.in(0), l.out(), Launch::Real{factor},
               Launch::Real{offset}, w.plane, w.block);
  }
  int overwrites() const override { return 0; }
};

}  // namespace

Value add(Value a, Value b, double weight) { return a.graph().make<AddOp>({a, b}, weight); }
Value subtract(Value a, Value b) { return add(a, b, -1); }
Value multiply(Value a, Value b) { return a.graph().make<MultiplyOp>({a, b}); }
Value affine(Value a, double factor, double offset) { return a.graph().make<AffineOp>({a}, factor, offset); }
Value expand(Value b, const Shape& shape, double factor) { return b.graph().make<ExpandOp>({b}, shape, factor); }

}  // namespace clerestory
