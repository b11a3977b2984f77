// The kernels that a machine is measured by compute what their names say.
#include <cmath>

#include "checks/kernel_check.hpp"
#include "host/cl/small_integers.hpp"

namespace clerestory {
namespace {

constexpr const char* file = "tensor/ceilings.cl";
constexpr int kChains = 12, kRounds = 5;

/// A sum of chains that start at id + c and become x * factor + term a round.
std::vector<double> chains(int items, int lanes) {
  std::vector<double> want;
  for (int id = 0; id < items; ++id) {
    double total = 0;
    for (int c = 0; c < kChains; ++c) {
      double x = id + c;
      for (int round = 0; round < kRounds; ++round) x = x * 0.5 + 2;
      total += x;
    }
    want.insert(want.end(), static_cast<std::size_t>(lanes), total);
  }
  return want;
}

void multiply_adds(Device device, OpFindings& findings, const char* name, int width, int lanes) {
  constexpr int items = 7;
  const Kernel kernel = device.kernel(file, name, {{"WIDTH", std::to_string(width)}});
  const Buffer out = device.allocate(sizeof(float) * items * static_cast<std::size_t>(lanes));
  device.launch(kernel, Range::of(items, 1), out, kRounds, 0.5f, 2.f);
  // Each round and each chain rounds once.
  expect_close(findings, fmt::format("{} of {}", name, width), downloaded<float>(device, out), chains(items, lanes),
               kRounds + kChains);
}

void triad(Device device, OpFindings& findings, const char* name, int lanes) {
  constexpr std::size_t items = 5;
  const std::size_t count = items * static_cast<std::size_t>(lanes);
  const std::vector<float> a = small_integers<float>(count, 1, 8), b = small_integers<float>(count, 2, 8);
  std::vector<double> want;
  for (std::size_t i = 0; i < count; ++i) want.push_back(static_cast<double>(a[i]) + 3 * static_cast<double>(b[i]));
  const Buffer c = device.allocate(count * sizeof(float));
  device.launch(device.kernel(file, name), Range::of(items, 1), uploaded(device, a), uploaded(device, b), c, 3.f);
  expect_close(findings, name, downloaded<float>(device, c), want, 0);
}

void nothing(Device device, OpFindings& findings) {
  const Buffer out = uploaded(device, std::vector<float>{7});
  device.launch(device.kernel(file, "nothing"), Range::of(1, 1), out, 0);
  expect_close(findings, "nothing", downloaded<float>(device, out), {7}, 0);
}

}  // namespace

KERNEL_CHECK(ceilings) {
  return {.stem = "ceilings",
          .kernels = {"fma_wide", "fma_narrow", "triad_wide", "triad_narrow", "nothing"},
          .run = [](const CheckedDevices& devices, OpFindings& findings, bool) {
            for (const int width : {4, 8, 16}) multiply_adds(devices.single, findings, "fma_wide", width, width);
            multiply_adds(devices.single, findings, "fma_narrow", 4, 1);
            triad(devices.single, findings, "triad_wide", 16), triad(devices.single, findings, "triad_narrow", 1);
            nothing(devices.single, findings);
          }};
}

}  // namespace clerestory
