// Rays from around the origin, between lamps.
#pragma once
#include "checks/op_case.hpp"
#include "host/ops/light/soft_lamps.hpp"

namespace clerestory::soft_lamps_rays {

/// Lamps 2 m around the origin, of sizes low to high; rays from within half a metre, one of them without a direction.
inline Tensors rays(int rows, int samples, int lamps, bool per_row, double low, double high) {
  Tensors in{{"points", random_tensor({1, 3, rows, per_row ? 1 : samples}, 1, -0.5, 0.5)},
             {"direction", random_tensor({1, 3, rows, samples}, 2)},
             {"u", random_tensor({1, 1, rows, samples}, 3, 0, 1)},
             {"specular", random_tensor({1, 3, rows, samples}, 10, 0, 1)},
             {"lobe", random_tensor({1, 1, rows, samples}, 9, 0, 2)},
             {"places", random_tensor({1, 4, 1, lamps}, 4, -2, 2)}};
  const Tensor sizes = random_tensor({1, 1, 1, lamps}, 5, low, high);
  for (int k = 0; k < lamps; ++k) in.at("places").at(0, 3, 0, k) = sizes.at(0, 0, 0, k);
  for (int c = 0; c < 3; ++c) in.at("direction").at(0, c, 0, 1) = 0;
  return in;
}

inline LampRays rays_of(const Values& v) {
  const Lobes lobes = v.contains("lobe") ? Lobes{v.at("specular"), v.at("lobe")} : Lobes{};
  return {v.at("points"), v.at("direction"), v.at("u"), lobes};
}

}  // namespace clerestory::soft_lamps_rays
