// Does a device compute what it is told? Asked once per device and driver, before its first use. Private to host/cl.
#pragma once
#include <string>

#include "host/cl/device.hpp"

namespace clerestory {

/// Runs a packed float16 matrix product on whole numbers (must be exact) with a long sum, elementary functions (within
/// the errors OpenCL C allows) and buffer round trips. Empty when all is well, else what went wrong. `defines` switches
/// faults on, for tests: PROBE_FAULT_PRODUCT, PROBE_FAULT_FUNCTION.
std::string probe_fault(Device& device, Precision precision = Precision::Single, const Defines& defines = {});

/// The same, remembered on disk by the device's fingerprint and the probe's source, so that it costs nothing next time.
/// A driver error during the probe is a fault too, but not a verdict to remember.
std::string remembered_probe_fault(Device& device, Precision precision);

}  // namespace clerestory
