// Random numbers that are functions of a key: the same on every machine and whatever the threads do.
#pragma once
#include <cstdint>

#include "host/math/vec.hpp"

namespace clerestory {

/// SplitMix64's step and finaliser.
std::uint64_t keyed_mix(std::uint64_t z);

/// 64 bits of a key (SplitMix64's finaliser; Steele, Lea and Flood 2014), and as a number in [0, 1).
std::uint64_t keyed_bits(std::uint64_t seed, std::uint64_t position, std::uint64_t purpose);
double keyed_uniform(std::uint64_t seed, std::uint64_t position, std::uint64_t purpose);

/// Numbers of one key and purpose in turn.
class KeyedDraws {
 public:
  KeyedDraws(std::uint64_t key, std::uint64_t purpose) : key_(key), purpose_(purpose) {}
  double unit() { return keyed_uniform(key_, next_++, purpose_); }  // in [0, 1)
  double between(double low, double high) { return low + (high - low) * unit(); }
  double log_between(double low, double high);
  int below(int count);  // 0 to count - 1
  bool chance(double share) { return unit() < share; }
  Vec3 direction();  // uniform over the sphere

 private:
  std::uint64_t key_, purpose_, next_ = 0;
};

}  // namespace clerestory
