// Numbers whose products and sums are exact, for checking what a device computes.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace clerestory {

/// `count` whole numbers of `bits` bits, from -2^(bits - 1) to 2^(bits - 1) - 1, which look like noise.
template <class Real>
std::vector<Real> small_integers(std::size_t count, std::uint32_t seed, int bits) {
  std::vector<Real> values(count);
  for (Real& value : values) {
    seed = seed * 1664525u + 1013904223u;
    value = static_cast<Real>(static_cast<int>(seed >> (32 - bits)) - (1 << (bits - 1)));
  }
  return values;
}

}  // namespace clerestory
