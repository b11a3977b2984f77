// Wall time.
#pragma once
#include <chrono>

namespace clerestory {

/// Of a clock that only goes forward; from which moment it counts is not said.
inline double clock_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

class Stopwatch {
 public:
  /// Since it was made, or since the last lap.
  double seconds() const { return clock_seconds() - start_; }
  /// seconds(), and begins again.
  double lap() {
    const double now = clock_seconds(), elapsed = now - start_;
    start_ = now;
    return elapsed;
  }

 private:
  double start_ = clock_seconds();
};

}  // namespace clerestory
