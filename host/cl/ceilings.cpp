#include "host/cl/ceilings.hpp"

#include <algorithm>

#include "host/cl/seconds_of.hpp"
#include "host/cl/tile.hpp"

namespace clerestory {
namespace {

constexpr const char* file = "tensor/ceilings.cl";
constexpr int chains = 12;  // CHAINS of the kernel file
constexpr int tries = 8, calibration_tries = 3;

template <class Work>
double best_seconds(Device& device, int count, Work work) {
  double best = seconds_of(device, work);
  for (int i = 1; i < count; ++i) best = std::min(best, seconds_of(device, work));
  return best;
}

/// Operations per second of one of the fma kernels, with as many rounds as keep it busy for some milliseconds.
double fma_rate(Device& device, const char* name, std::size_t items, std::size_t local, int lanes) {
  constexpr double long_enough = 8e-3;
  const Kernel kernel = device.kernel(file, name, {{"WIDTH", std::to_string(std::max(lanes, 4))}});
  const Buffer out = device.allocate(items * lanes * sizeof(float));
  int rounds = 64;
  const auto work = [&] { device.launch(kernel, Range::of(items, local), out, rounds, 0.999f, 0.001f); };
  seconds_of(device, work);  // some drivers compile at the first launch
  while (best_seconds(device, calibration_tries, work) < long_enough && rounds < (1 << 24)) rounds *= 2;
  return 2.0 * chains * lanes * rounds * static_cast<double>(items) / best_seconds(device, tries, work);
}

double fma_gflops(Device& device) {
  const std::size_t units = device.info().compute_units;
  const std::size_t group = std::min<std::size_t>(256, device.info().max_group);
  const double wide = fma_rate(device, "fma_wide", 64 * units, 1, fastest_tile(device).width);
  const double narrow = fma_rate(device, "fma_narrow", 16 * group * units, group, 1);
  return std::max(wide, narrow) * 1e-9;
}

double bandwidth_gbs(Device& device) {
  constexpr std::size_t local = 64, wide = 16;
  std::size_t numbers =
      std::min({std::size_t{64} << 20, device.info().memory / 16, device.info().max_allocation}) / sizeof(float);
  numbers -= numbers % (local * wide);  // no remainders for the kernels to guard
  const std::size_t bytes = numbers * sizeof(float);
  const Buffer a = device.allocate(bytes), b = device.allocate(bytes), c = device.allocate(bytes);
  device.zero(a, bytes), device.zero(b, bytes);
  const auto rate = [&](const char* name, std::size_t items) {
    const Kernel kernel = device.kernel(file, name);
    const auto work = [&] { device.launch(kernel, Range::of(items, local), a, b, c, 3.0f); };
    seconds_of(device, work);
    return 3.0 * static_cast<double>(bytes) / best_seconds(device, tries, work);
  };
  return std::max(rate("triad_wide", numbers / wide), rate("triad_narrow", numbers)) * 1e-9;
}

double launch_us(Device& device, int launches) {
  const Kernel kernel = device.kernel(file, "nothing");
  const Buffer out = device.allocate(sizeof(float));
  const auto work = [&] {
    for (int i = 0; i < launches; ++i) device.launch(kernel, Range::of(1, 1), out, 0);
  };
  seconds_of(device, work);
  return best_seconds(device, tries, work) / launches * 1e6;
}

}  // namespace

Ceilings measure_ceilings(Device& device) {
  return {fma_gflops(device), bandwidth_gbs(device), launch_us(device, 500), launch_us(device, 1)};
}

std::string describe(const Ceilings& c) {
  return fmt::format("{:.0f} GFLOP/s multiply-add, {:.1f} GB/s triad, {:.1f} us per launch, {:.0f} us per round trip",
                     c.fma_gflops, c.bandwidth_gbs, c.launch_us, c.round_trip_us);
}

}  // namespace clerestory
