// The hash of kernels/lib/rng.clh written again: what random4 gives for its four keys.
#pragma once
#include <array>
#include <cstdint>

namespace clerestory {

inline std::array<std::uint32_t, 4> hashed_bits(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  std::array<std::uint32_t, 4> v{a, b, c, d};
  const auto mix = [&] { v[0] += v[1] * v[3], v[1] += v[2] * v[0], v[2] += v[0] * v[1], v[3] += v[1] * v[2]; };
  for (std::uint32_t& k : v) k = k * 1664525u + 1013904223u;
  mix();
  for (std::uint32_t& k : v) k ^= k >> 16;
  mix();
  return v;
}

/// The top 24 bits as a number in [0, 1).
inline double unit_of(std::uint32_t bits) { return (bits >> 8) * 0x1p-24; }

inline std::array<double, 4> hashed(std::uint32_t seed, std::uint32_t pixel, std::uint32_t sample,
                                    std::uint32_t block) {
  const std::array<std::uint32_t, 4> v = hashed_bits(seed, pixel, sample, block);
  return {unit_of(v[0]), unit_of(v[1]), unit_of(v[2]), unit_of(v[3])};
}

}  // namespace clerestory
