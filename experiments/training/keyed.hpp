// Random numbers that are functions of a key: the same on every machine and whatever the threads do.
#pragma once
#include <cstdint>

namespace clerestory {

/// SplitMix64's step and finaliser.
std::uint64_t keyed_mix(std::uint64_t z);

/// 64 bits of a key (SplitMix64's finaliser; Steele, Lea and Flood 2014), and as a number in [0, 1).
std::uint64_t keyed_bits(std::uint64_t seed, std::uint64_t position, std::uint64_t purpose);
double keyed_uniform(std::uint64_t seed, std::uint64_t position, std::uint64_t purpose);

}  // namespace clerestory
