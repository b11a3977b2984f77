// Kernels that are no op's (of map_chunks, the tracer, the probe, measurements): each file of them has one check, under
// its stem. checks/<group>/<stem>.cpp declares it with KERNEL_CHECK; nothing else names it.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "checks/op_check.hpp"

namespace clerestory {

struct KernelCheck {
  std::string stem = {};
  std::vector<std::string> kernels = {};  // each must be seen to run in float
  /// Adds what it finds. `devices` may have none with doubles. Quick: what a simulator does within a minute or so.
  std::function<void(const CheckedDevices& devices, OpFindings& findings, bool quick)> run = {};
};

/// All of the program, in no promised order.
const std::vector<KernelCheck>& declared_kernel_checks();
/// Before main().
bool declare_kernel_check(KernelCheck (*make)());

/// Errors of the device, and kernels that were not launched, are faults. Suspects are the kernels that a fault names,
/// all where it names none.
OpFindings check_kernels(const KernelCheck& check, const CheckedDevices& devices, bool quick = false);

/// Numbers of a kernel beside what they should be: one that is off by more than `roundings` epsilons of float of the
/// largest |want| is a fault, and so is a NaN; the worst goes into value_error and value_ulps. Roundings 0: equal.
void expect_close(OpFindings& findings, const std::string& what, const std::vector<double>& got,
                  const std::vector<double>& want, double roundings);

template <class T>
Buffer uploaded(Device& device, const std::vector<T>& values) {
  Buffer buffer = device.allocate(values.size() * sizeof(T));
  device.write(buffer, values.data(), buffer.bytes());
  return buffer;
}

template <class T>
std::vector<double> downloaded(Device& device, const Buffer& buffer) {
  std::vector<T> values(buffer.bytes() / sizeof(T));
  device.read(buffer, values.data(), buffer.bytes());
  return {values.begin(), values.end()};
}

}  // namespace clerestory

/// KERNEL_CHECK(place) { return {.stem = "place", ...}; }
#define KERNEL_CHECK(name)                                                                                     \
  static ::clerestory::KernelCheck kernel_check_of_##name();                                                   \
  static const bool kernel_check_declared_##name = ::clerestory::declare_kernel_check(kernel_check_of_##name); \
  static ::clerestory::KernelCheck kernel_check_of_##name()
