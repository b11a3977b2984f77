// Calls of the kernel headers' functions (kernels/lib/surface_probe.cl).
#pragma once
#include <vector>

#include "host/cl/device.hpp"

namespace clerestory {

/// Buffers of the device's reals, as doubles.
class Probe {
 public:
  Probe(Device device, Precision precision) : device_(std::move(device)), precision_(precision) {}
  Buffer upload(const std::vector<double>& values);
  std::vector<double> download(const Buffer& buffer, std::size_t count);
  /// Runs `kernel` of the probe over `count` work-items; `out_rows` rows of `count`.
  template <class... Args>
  std::vector<double> run(const char* kernel, int sampler, int count, int out_rows, const std::vector<Buffer>& in,
                          const Args&... more) {
    const Buffer out =
        device_.allocate(static_cast<std::size_t>(count) * static_cast<std::size_t>(out_rows) * real_size(precision_));
    std::vector<Arg> args(in.begin(), in.end());
    args.emplace_back(out), args.emplace_back(count);
    (args.emplace_back(more), ...);
    const Kernel k = device_.kernel("lib/surface_probe.cl", kernel, {{"SAMPLER", std::to_string(sampler)}}, precision_);
    device_.launch_with(k, Range::of(static_cast<std::size_t>(count)), args);
    return download(out, static_cast<std::size_t>(count) * static_cast<std::size_t>(out_rows));
  }
  Arg real(double value) const {
    if (precision_ == Precision::Double) return Arg(value);
    return Arg(static_cast<float>(value));
  }

 private:
  Device device_;
  Precision precision_;
};

}  // namespace clerestory
