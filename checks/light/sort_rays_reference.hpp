// The order of rays by the pixels that they hit, by std::stable_sort.
#pragma once
#include <algorithm>
#include <numeric>

#include "checks/op_case.hpp"

namespace clerestory::sort_rays_reference {

inline std::vector<Tensor> sorted_reference(const Tensor& hit, const Shape& map) {
  const int keys = static_cast<int>(map.n * map.plane()), plane = static_cast<int>(map.plane());
  std::vector<int> key(hit.integer.size());
  for (std::size_t i = 0; i < key.size(); ++i) {
    const int first = std::min(static_cast<int>(i) / hit.shape.w / plane, static_cast<int>(map.n) - 1) * plane;
    key[i] = hit.integer[i] < 0 ? keys : first + hit.integer[i];
  }
  Tensor order = hit, starts = random_ints({1, 1, 1, keys + 1}, 1, 0, 1);
  std::iota(order.integer.begin(), order.integer.end(), 0);
  const auto key_of = [&](int ray) { return key[static_cast<std::size_t>(ray)]; };
  std::stable_sort(order.integer.begin(), order.integer.end(), [&](int a, int b) { return key_of(a) < key_of(b); });
  for (int k = 0; k <= keys; ++k)
    starts.integer[static_cast<std::size_t>(k)] =
        static_cast<int>(std::count_if(key.begin(), key.end(), [&](int value) { return value < k; }));
  return {order, starts};
}

}  // namespace clerestory::sort_rays_reference
