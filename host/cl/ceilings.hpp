// What a device can do at most, measured: the ceilings that speeds are compared with. Machines are noisy and shared, so
// measure them in the same run as what is compared.
#pragma once
#include "host/cl/device.hpp"

namespace clerestory {

struct Ceilings {
  double fma_gflops =
      0;  // single-precision multiply-adds, two operations each, in 10^9 per second, in vectors of the tile's width
  double bandwidth_gbs = 0;  // STREAM's triad on arrays too large for caches, 10^9 bytes read and written per second
  double launch_us = 0;      // one launch of an empty kernel among many, microseconds
  double round_trip_us = 0;  // the same when each is waited for
};

/// The best of several tries each; takes about half a second with a warm program cache, and 192 MiB of device memory
/// (less where the device has less).
Ceilings measure_ceilings(Device& device);

/// "297 GFLOP/s multiply-add, 14.1 GB/s triad, 2.0 us per launch, 12 us per round trip".
std::string describe(const Ceilings& ceilings);

}  // namespace clerestory
