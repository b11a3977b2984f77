// Hashed Owen-scrambled Sobol points (Burley 2020, "Practical hash-based Owen scrambling", JCGT 9(4)) written again
// from the published tables: direction numbers by primitive polynomials and initial values, bits one by one.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "checks/shade/hash_reference.hpp"

namespace clerestory {

using Point4 = std::array<std::uint32_t, 4>;

/// Direction numbers of one dimension as 32-bit fractions, from a row of new-joe-kuo-6.21201 (Joe and Kuo 2008):
/// degree s, coefficients a, initial m; s = 0: van der Corput's sequence.
inline std::array<std::uint32_t, 32> direction_numbers(unsigned s, unsigned a, const std::vector<std::uint32_t>& m) {
  std::array<std::uint32_t, 32> v{};
  for (unsigned k = 0; k < 32; ++k) {
    if (s == 0 || k < s) {
      v[k] = (s == 0 ? 1u : m[k]) << (31 - k);
      continue;
    }
    v[k] = v[k - s] ^ (v[k - s] >> s);
    for (unsigned j = 1; j < s; ++j)
      if (a >> (s - 1 - j) & 1u) v[k] ^= v[k - j];
  }
  return v;
}

inline Point4 sobol_reference(std::uint32_t index) {
  static const std::array<std::array<std::uint32_t, 32>, 4> numbers{
      direction_numbers(0, 0, {}), direction_numbers(1, 0, {1}), direction_numbers(2, 1, {1, 3}),
      direction_numbers(3, 1, {1, 3, 1})};
  Point4 point{};
  for (unsigned d = 0; d < 4; ++d)
    for (unsigned k = 0; k < 32; ++k)
      if (index >> k & 1u) point[d] ^= numbers[d][k];
  return point;
}

/// Burley's listing 2: Laine and Karras's permutation of the reversed bits, with his constants.
inline std::uint32_t owen_reference(std::uint32_t x, std::uint32_t key) {
  const auto reversed = [](std::uint32_t bits) {
    std::uint32_t r = 0;
    for (unsigned k = 0; k < 32; ++k) r |= (bits >> k & 1u) << (31 - k);
    return r;
  };
  x = reversed(x) + key;
  for (const std::uint32_t factor : {0x6c50b47cu, 0xb82f1e52u, 0xc7afe638u, 0x8d22f6e6u}) x ^= x * factor;
  return reversed(x);
}

/// The finaliser of MurmurHash3.
inline std::uint32_t murmur_reference(std::uint32_t x) {
  x ^= x >> 16, x *= 0x85ebca6bu;
  x ^= x >> 13, x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

/// What sobol_point4 of kernels/lib/rng.clh promises: each dimension scrambled by a key of its own; blocks after the
/// first take the points in an order shuffled by a key of both of the first two.
inline Point4 scrambled_sobol_reference(std::uint32_t seed, std::uint32_t pixel, std::uint32_t sample,
                                        std::uint32_t block) {
  Point4 keys = hashed_bits(seed, pixel, block, 0x536f626fu);  // "Sobo"
  for (std::uint32_t& k : keys) k ^= k >> 16;
  const std::uint32_t order = murmur_reference(keys[0] ^ (murmur_reference(keys[1] + 0x9e3779b9u) + 0x7f4a7c15u));
  Point4 point = sobol_reference(block == 0 ? sample : owen_reference(sample, order));
  for (unsigned d = 0; d < 4; ++d) point[d] = owen_reference(point[d], keys[d]);
  return point;
}

}  // namespace clerestory
