// Calls of the functions in kernels/trace (kernels/trace/scene_probe.cl), in float or in double.
#pragma once
#include "tests/tracer/scenes.hpp"

namespace clerestory {

/// The test's device, or another one that has doubles.
inline Device double_device() {
  if (test_device().has_double()) return test_device();
  for (const DeviceInfo& info : list_devices())
    if (info.fp64) return Device::open(std::to_string(info.index));
  throw Error(ErrorKind::Device, "no device here has doubles", "tests");
}

template <class Real>
Buffer upload(Device& device, const std::vector<double>& values) {
  const std::vector<Real> reals(values.begin(), values.end());
  Buffer buffer = device.allocate(reals.size() * sizeof(Real));
  device.write(buffer, reals.data(), reals.size() * sizeof(Real));
  return buffer;
}

template <class Real>
std::vector<double> download(Device& device, const Buffer& buffer, std::size_t count) {
  std::vector<Real> reals(count);
  device.read(buffer, reals.data(), count * sizeof(Real));
  return {reals.begin(), reals.end()};
}

/// Runs `kernel` of the probe over `count` work-items on rows of `at`; gives `rows` rows of `count`.
template <class Real>
std::vector<double> probe(const char* kernel, std::vector<Arg> args, Device& device, const std::vector<double>& at,
                          int count, int rows) {
  const std::size_t size = static_cast<std::size_t>(count) * static_cast<std::size_t>(rows);
  const Buffer in = upload<Real>(device, at), out = device.allocate(size * sizeof(Real));
  for (const Arg& arg : {Arg(in), Arg(out), Arg(count)}) args.push_back(arg);
  const Precision precision = sizeof(Real) == 8 ? Precision::Double : Precision::Single;
  device.launch_with(device.kernel("trace/scene_probe.cl", kernel, {}, precision),
                     Range::of(static_cast<std::size_t>(count)), args);
  return download<Real>(device, out, size);
}

}  // namespace clerestory
