#include "experiments/bench/bench.hpp"

#include <algorithm>

#include "host/cl/seconds_of.hpp"

namespace clerestory {

double best_seconds(Device& device, Executor& executor) {
  const auto timed = [&] { return seconds_of(device, [&] { executor.run(); }); };
  timed();
  double best = 1e30, spent = 0;
  for (int i = 0; i < 10 && (i == 0 || spent < 0.33); ++i) {
    const double seconds = timed();
    best = std::min(best, seconds), spent += seconds;
  }
  return best;
}

double peak_gflops(double fma_gflops, double flops, const std::vector<BenchRow>& rows) {
  double peak = fma_gflops;
  for (const BenchRow& row : rows)
    for (const double seconds : row.seconds) peak = std::max(peak, flops / seconds * 1e-9);
  return peak;
}

std::string row_text(const BenchRow& row, double flops, double peak) {
  std::string text;
  for (const double seconds : row.seconds) {
    const double gflops = flops / seconds * 1e-9;
    text += fmt::format("{:>12.2f}{:>7.0f}{:>4.0f}%", seconds * 1e3, gflops, 100 * gflops / peak);
  }
  return text;
}

Tensor noise(const Shape& shape, std::uint32_t seed, double size) {
  Tensor t(shape);
  for (double& v : t.real) {
    seed = seed * 1664525u + 1013904223u;
    v = size * (static_cast<double>(seed >> 8) * 0x1p-23 - 1);
  }
  return t;
}

}  // namespace clerestory
