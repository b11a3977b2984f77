#include "experiments/bench/bench.hpp"

#include <algorithm>

#include "host/cl/seconds_of.hpp"

namespace clerestory {

std::vector<double> seconds_of_runs(Device& device, Executor& executor, int runs) {
  const auto timed = [&] { return seconds_of(device, [&] { executor.run(); }); };
  timed();
  std::vector<double> seconds;
  double spent = 0;
  const auto enough = [&](int done) { return runs > 0 ? done >= runs : done >= 10 || (done > 0 && spent >= 0.33); };
  for (int i = 0; !enough(i); ++i) spent += seconds.emplace_back(timed());
  return seconds;
}

double best_of(const std::vector<double>& seconds) { return *std::ranges::min_element(seconds); }

double peak_gflops(double fma_gflops, double flops, const std::vector<BenchRow>& rows) {
  double peak = fma_gflops;
  for (const BenchRow& row : rows)
    for (const std::vector<double>& seconds : row.passes) peak = std::max(peak, flops / best_of(seconds) * 1e-9);
  return peak;
}

std::string row_text(const BenchRow& row, double flops, double peak) {
  std::string text;
  for (const std::vector<double>& seconds : row.passes) {
    const double best = best_of(seconds), gflops = flops / best * 1e-9;
    text += fmt::format("{:>12.2f}{:>7.0f}{:>4.0f}%", best * 1e3, gflops, 100 * gflops / peak);
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
