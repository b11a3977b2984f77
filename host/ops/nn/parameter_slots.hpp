// Parameters are many and mostly small, and a launch costs more than most of them do: one launch takes as many as its
// arguments hold (kernels/lib/slots.clh).
#pragma once
#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <tuple>
#include <utility>

#include "host/math/integers.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {

/// A run of `count` numbers in each of several tensors.
template <std::size_t tensors>
struct Slot {
  std::array<TensorView, tensors> views;
  int count = 0;
};
inline constexpr std::size_t kSlots = 8;  // of a launch

namespace detail {

template <std::size_t tensors, class... Rest, std::size_t... k>
void run_some_slots(Launch& l, const char* file, const char* kernel, std::span<const Slot<tensors>> slots,
                    std::index_sequence<k...>, const Rest&... rest) {
  const int block = row_blocks(l.device, std::numeric_limits<int>::max()).length;
  std::array<int, kSlots> begin;
  begin.fill(std::numeric_limits<int>::max());  // a slot without numbers
  int groups = 0;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    begin[i] = groups;
    groups += ceil_div(slots[i].count, block);
  }
  const auto arguments = [&](std::size_t i) {
    const Slot<tensors>& slot = slots[std::min(i, slots.size() - 1)];
    return std::tuple_cat(slot.views, std::tie(slot.count, begin[i]));
  };
  std::apply(
      [&](const auto&... argument) {
        l.run_with(row_defines(l.device), file, kernel, row_range(l.device, groups), argument..., rest..., block);
      },
      std::tuple_cat(arguments(k)...));
}

}  // namespace detail

/// Runs the kernel on all slots, kSlots a launch. Its arguments are the slots' tensors, counts and first work-groups,
/// `rest` and the numbers of a work-group.
template <std::size_t tensors, class... Rest>
void run_slots(Launch& l, const char* file, const char* kernel, std::span<const Slot<tensors>> slots,
               const Rest&... rest) {
  for (std::size_t first = 0; first < slots.size(); first += kSlots)
    detail::run_some_slots(l, file, kernel, slots.subspan(first, std::min(kSlots, slots.size() - first)),
                           std::make_index_sequence<kSlots>{}, rest...);
}

}  // namespace clerestory
