#include "host/ops/tensor/slice.hpp"

#include <algorithm>

#include "host/graph/meeting.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

/// dx from dy: zeros around the slice.
struct SliceAdjointOp : Op, Placing {
  int first;
  Shape whole;
  SliceAdjointOp(int f, Shape s) : first(f), whole(s) {}
  std::string name() const override { return "slice_adjoint"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{whole, Type::Real}}; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {slice(g[0], first, node.in_shape(0).c)};
  }
  void launch(Launch& l) const override {
    const Blocks blocks = row_blocks(l.device, whole.item());
    l.run_with(row_defines(l.device), "tensor/slice.cl", "slice_adjoint", row_range(l.device, blocks.count, whole.n),
               l.in(0), l.out(), static_cast<int>(first * whole.plane()), static_cast<int>(l.in(0).shape.item()),
               static_cast<int>(whole.item()), blocks.length);
  }

  /// Slices side by side, zeros between them: nothing where they overlap.
  Value sum_of(std::span<const Value> terms) const override {
    std::vector<std::pair<int, Value>> slices;
    for (const Value& term : terms) {
      const auto* op = dynamic_cast<const SliceAdjointOp*>(term.node->op.get());
      if (!op) return {};
      slices.emplace_back(op->first, term.node->inputs[0]);
    }
    std::ranges::stable_sort(slices, {}, [](const auto& s) { return s.first; });
    std::vector<Value> parts;
    int channels = 0;
    const auto zeros_up_to = [&](int channel) {
      if (channel > channels)
        parts.push_back(terms[0].graph().fill({whole.n, channel - channels, whole.h, whole.w}, 0));
    };
    for (const auto& [at, part] : slices) {
      if (at < channels) return {};
      zeros_up_to(at);
      parts.push_back(part);
      channels = at + part.shape().c;
    }
    zeros_up_to(whole.c);
    return concat(parts);
  }
};

struct SliceOp : Op {
  int first, count;
  SliceOp(int f, int c) : first(f), count(c) {}
  std::string name() const override { return "slice"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    Shape s = in[0].shape();
    if (first < 0 || count < 1 || first + count > s.c)
      throw Error(ErrorKind::Failed, "channels beyond the tensor", "slice", fmt::format("{} from {}", count, first),
                  s.text());
    s.c = count;
    return {{s, Type::Real}};
  }

  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {node.inputs[0].graph().make<SliceAdjointOp>({g[0]}, first, node.in_shape(0))};
  }

  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const Blocks blocks = row_blocks(l.device, s.item());
    l.run_with(row_defines(l.device), "tensor/slice.cl", "slice_take", row_range(l.device, blocks.count, s.n), l.in(0),
               l.out(), static_cast<int>(first * s.plane()), static_cast<int>(s.item()), blocks.length);
  }

  long view_offset(const Node& node) const override { return first * node.in_shape(0).plane(); }
};

}  // namespace

Value slice(Value x, int first, int count) {
  if (first == 0 && count == x.shape().c) return x;
  return x.graph().make<SliceOp>({x}, first, count);
}

}  // namespace clerestory
