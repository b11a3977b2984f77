#include "experiments/training/keyed.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

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

double KeyedDraws::log_between(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }

int KeyedDraws::below(int count) { return std::min(count - 1, static_cast<int>(unit() * count)); }

Vec3 KeyedDraws::direction() {
  const double z = between(-1, 1), angle = between(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace clerestory
