#include "host/ops/nn/square_sums.hpp"

#include <algorithm>
#include <utility>

#include "host/ops/nn/parameter_slots.hpp"
#include "host/ops/tensor/concat.hpp"

namespace clerestory {
namespace {

struct SquareSumsOp : NotDifferentiable {  // up to kSlots tensors
  std::string name() const override { return "square_sums"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{{1, static_cast<int>(in.size()), 1, 1}, Type::Real}};
  }

  void launch(Launch& l) const override { launch_all(l, std::make_index_sequence<kSlots>{}); }

 private:
  template <std::size_t... k>
  void launch_all(Launch& l, std::index_sequence<k...>) const {
    // A slot that is left over names the last tensor, and no work-group takes it.
    const auto slot = [&](std::size_t i) {
      const TensorView& x = l.inputs[std::min(i, l.inputs.size() - 1)];
      return std::tuple(x, x.shape.n, static_cast<int>(x.shape.item()));
    };
    std::apply(
        [&](const auto&... argument) {
          l.run_with(row_defines(l.device), "nn/square_sums.cl", "square_sums",
                     row_range(l.device, static_cast<long>(l.inputs.size())), argument..., l.out());
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
