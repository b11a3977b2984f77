#include "experiments/training/keyed.hpp"

namespace clerestory {

std::uint64_t keyed_mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

std::uint64_t keyed_bits(std::uint64_t seed, std::uint64_t position, std::uint64_t purpose) {
  return keyed_mix(keyed_mix(keyed_mix(seed) ^ position) ^ purpose);
}

double keyed_uniform(std::uint64_t seed, std::uint64_t position, std::uint64_t purpose) {
  return static_cast<double>(keyed_bits(seed, position, purpose) >> 11) * 0x1p-53;
}

}  // namespace clerestory
