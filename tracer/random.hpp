// Random numbers for building rooms, which do not hang on a standard library's distributions. Numbers drawn in one
// expression are drawn in the compiler's order: another compiler makes other rooms of a seed, files of rooms stay.
#pragma once
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <initializer_list>
#include <vector>

namespace clerestory {

/// SplitMix64 (Steele, Lea and Flood 2014): one step and finaliser per number.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  /// An independent stream for a part of the work, so that changing one part leaves the others as they are.
  Random fork(std::uint64_t stream) const { return Random(mix(state_ ^ mix(stream + 0x9e3779b97f4a7c15u))); }

  /// What a kernel counts its random numbers from, of such a part.
  std::uint32_t seed(std::uint64_t stream) const { return static_cast<std::uint32_t>(fork(stream).bits()); }

  std::uint64_t bits() { return mix(state_ += 0x9e3779b97f4a7c15u); }
  float unit() { return static_cast<float>(bits() >> 40) * 0x1p-24f; }  // [0, 1)
  float between(float low, float high) { return low + (high - low) * unit(); }
  /// As likely in one octave as in the next; 0 < low.
  float log_between(float low, float high) { return low * std::exp(unit() * std::log(high / low)); }
  /// low <= result <= high.
  int whole(int low, int high) { return low + static_cast<int>(bits() % static_cast<std::uint64_t>(high - low + 1)); }
  bool chance(float probability) { return unit() < probability; }
  template <class T>
  const T& one_of(const std::vector<T>& values) {
    return values[bits() % values.size()];
  }
  template <class T>
  T one_of(std::initializer_list<T> values) {
    return values.begin()[bits() % values.size()];
  }
  template <class T>
  void shuffle(std::vector<T>& values) {
    for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[bits() % i]);
  }

  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

 private:
  std::uint64_t state_;
};

}  // namespace clerestory
