#include "host/ops/nn/square_sums.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "host/ops/nn/parameter_slots.hpp"
#include "host/ops/tensor/concat.hpp"

namespace clerestory {
namespace {

constexpr int kParts = 64;  // work-groups of a tensor: the largest have millions of numbers

struct SquareSumsOp : NotDifferentiable {  // up to kSlots tensors
  std::string name() const override { return "square_sums"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{{1, static_cast<int>(in.size()), 1, 1}, Type::Real}};
  }

  void launch(Launch& l) const override {
    launch_sums(l, std::make_index_sequence<kSlots>{});
    const int tensors = static_cast<int>(l.inputs.size());
    l.run_with(row_defines(l.device), kFile, "square_totals", Range::of(l.inputs.size()), l.workspace, l.out(), tensors,
               kParts);
  }
  std::size_t workspace(const Node& node) const override { return kParts * node.inputs.size(); }

 private:
  static constexpr const char* kFile = "nn/square_sums.cl";

  template <std::size_t... k>
  void launch_sums(Launch& l, std::index_sequence<k...>) const {
    // A slot that is left over names the last tensor, and no work-group takes it.
    const auto slot = [&](std::size_t i) {
      const TensorView& x = l.inputs[std::min(i, l.inputs.size() - 1)];
      return std::tuple(x, x.shape.n, static_cast<int>(x.shape.item()));
    };
    const int tensors = static_cast<int>(l.inputs.size());
    const int block = row_blocks(l.device, std::numeric_limits<int>::max()).length;
    std::apply(
        [&](const auto&... argument) {
          l.run_with(row_defines(l.device), kFile, "square_sums", row_range(l.device, tensors, kParts), argument...,
                     l.workspace, tensors, block);
        },
        std::tuple_cat(slot(k)...));
  }
};

}  // namespace

Value square_sums(std::span<const Value> tensors) {
  std::vector<Value> parts;
  for (std::size_t first = 0; first < tensors.size(); first += kSlots) {
    const auto some = tensors.subspan(first, std::min(kSlots, tensors.size() - first));
    parts.push_back(some[0].graph().make<SquareSumsOp>({some.begin(), some.end()}));
  }
  return concat(parts);
}

}  // namespace clerestory
