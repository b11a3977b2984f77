// How long a device works.
#pragma once
#include "host/cl/device.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {

/// Wall time of what `work` asks of the device, from an idle device to an idle device.
template <class Work>
double seconds_of(Device& device, const Work& work) {
  device.finish();
  const Stopwatch watch;
  work();
  device.finish();
  return watch.seconds();
}

}  // namespace clerestory
