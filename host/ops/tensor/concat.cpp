#include "host/ops/tensor/concat.hpp"

#include "host/ops/tensor/rows.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

struct ConcatOp : Op {
  std::string name() const override { return "concat"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    if (in.empty()) throw Error(ErrorKind::Failed, "nothing to concatenate", "concat");
    Shape s = in[0].shape();
    s.c = 0;
    for (const Value& v : in) {
      const Shape& part = v.shape();
      if (part.n != s.n || part.h != s.h || part.w != s.w)
        throw Error(ErrorKind::Failed, "parts differ in more than channels", "concat", part.text(),
                    in[0].shape().text());
      s.c += part.c;
    }
    return {{s, Type::Real}};
  }

  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    std::vector<Value> gradients;
    for (int at = 0; const Value& v : node.inputs) {
      gradients.push_back(slice(g[0], at, v.shape().c));
      at += v.shape().c;
    }
    return gradients;
  }

  void launch(Launch& l) const override {
    long at = 0;
    for (const TensorView& part : l.inputs) {
      const long count = part.shape.item();
      const bool in_place = part.buffer.handle() == l.out().buffer.handle() &&
                            part.offset == l.out().offset + static_cast<std::uint64_t>(at) &&
                            (part.stride == l.out().stride || part.shape.n == 1);
      if (!in_place) {
        const Blocks blocks = row_blocks(l.device, count);
        l.run_with(row_defines(l.device), "tensor/concat.cl", "concat_part",
                   row_range(l.device, blocks.count, part.shape.n), part, l.out(), static_cast<int>(at),
                   static_cast<int>(count), blocks.length);
      }
      at += count;
    }
  }

  bool gathers_inputs() const override { return true; }
};

}  // namespace

Value concat(std::span<const Value> parts) {
  if (parts.size() == 1) return parts[0];
  if (parts.empty()) throw Error(ErrorKind::Failed, "nothing to concatenate", "concat");
  return parts[0].graph().make<ConcatOp>({parts.begin(), parts.end()});
}

}  // namespace clerestory
