// Wall time, and the time that processors spend on this process.
#pragma once
#include <chrono>
#include <ctime>

namespace clerestory {

/// Of a clock that only goes forward; from which moment it counts is not said.
inline double clock_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Of all processors and threads together: waiting, being stopped and what other processes do count nothing.
inline double processor_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
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
