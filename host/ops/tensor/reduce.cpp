#include "host/ops/tensor/reduce.hpp"

#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "tensor/reduce.cl";
enum class Axis { Plane, Channels, Batch };

/// factor * the sum along one axis.
struct SumOp : Op {
  Axis axis;
  double factor;
  SumOp(Axis a, double f) : axis(a), factor(f) {}
  std::string name() const override { return "sum"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    Shape s = in[0].shape();
    if (axis == Axis::Plane)
      s.h = s.w = 1;
    else
      (axis == Axis::Channels ? s.c : s.n) = 1;
    return {{s, Type::Real}};
  }

  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {expand(g[0], node.in_shape(0), factor)};
  }

  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    const int plane = static_cast<int>(s.plane()), item = static_cast<int>(s.item());
    const Launch::Real f{factor};
    if (axis == Axis::Plane)
      l.run_with(row_defines(l.device), kFile, "sum_plane", row_range(l.device, s.c, s.n), l.in(0), l.out(), f, plane);
    else if (axis == Axis::Channels)
      l.run_with(row_defines(l.device), kFile, "sum_channels", Range::of2(size(plane), size(s.n)), l.in(0), l.out(), f,
                 s.c, plane);
    else
      l.run_with(row_defines(l.device), kFile, "sum_batch", Range::of(size(item)), l.in(0), l.out(), f, s.n, item);
  }
};

}  // namespace

Value sum_to(Value x, const Shape& to, double factor) {
  const Shape from = x.shape();
  const bool fits = (to.n == from.n || to.n == 1) && (to.c == from.c || to.c == 1) &&
                    ((to.h == from.h && to.w == from.w) || to.plane() == 1);
  if (!fits)
    throw Error(ErrorKind::Failed, "not a sum of this tensor", "sum_to", to.text(),
                from.text() + " or 1 along some axes");
  const auto along = [&](Axis axis) {
    x = x.graph().make<SumOp>({x}, axis, factor);
    factor = 1;  // the first sum has applied it
  };
  if (to.plane() != from.plane()) along(Axis::Plane);
  if (to.c != from.c) along(Axis::Channels);
  if (to.n != from.n) along(Axis::Batch);
  return factor == 1 ? x : scale(x, factor);
}

Value sum(Value x) { return sum_to(x, {}); }
Value mean(Value x) { return sum_to(x, {}, 1.0 / static_cast<double>(x.shape().count())); }

Value plane_mean(Value x) {
  const Shape& s = x.shape();
  return sum_to(x, {s.n, s.c, 1, 1}, 1.0 / static_cast<double>(s.plane()));
}

}  // namespace clerestory
