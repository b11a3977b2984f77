// The hash of kernels/lib/rng.clh written again: what random4 gives for its four keys.
#pragma once
#include <array>
#include <cstdint>

namespace clerestory {

inline std::array<double, 4> hashed(std::uint32_t seed, std::uint32_t pixel, std::uint32_t sample,
                                    std::uint32_t block) {
  std::array<std::uint32_t, 4> v{seed, pixel, sample, block};
  const auto mix = [&] { v[0] += v[1] * v[3], v[1] += v[2] * v[0], v[2] += v[0] * v[1], v[3] += v[1] * v[2]; };
  for (std::uint32_t& k : v) k = k * 1664525u + 1013904223u;
  mix();
  for (std::uint32_t& k : v) k ^= k >> 16;
  mix();
  std::array<double, 4> unit{};
  for (std::size_t k = 0; k < 4; ++k) unit[k] = (v[k] >> 8) * 0x1p-24;
  return unit;
}

}  // namespace clerestory
