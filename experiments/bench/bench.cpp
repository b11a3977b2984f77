#include "experiments/bench/bench.hpp"

#include <algorithm>
#include <cmath>

#include "host/cl/seconds_of.hpp"

namespace clerestory {

std::vector<double> seconds_of_runs(int runs, const std::function<double()>& seconds_of_one) {
  seconds_of_one();
  std::vector<double> seconds;
  double spent = 0;
  const auto enough = [&](int done) { return runs > 0 ? done >= runs : done >= 10 || (done > 0 && spent >= 0.33); };
  for (int i = 0; !enough(i); ++i) spent += seconds.emplace_back(seconds_of_one());
  return seconds;
}

std::vector<double> seconds_of_runs(Device& device, Executor& executor, int runs) {
  return seconds_of_runs(runs, [&] { return seconds_of(device, [&] { executor.run(); }); });
}

double best_of(const std::vector<double>& seconds) { return *std::ranges::min_element(seconds); }

BenchTruth truth_of(Device& device, const Graph& graph, Value result, const std::map<std::string, Tensor>& feeds) {
  if (!device.has_double()) return {};
  std::map<std::string, Tensor> magnitudes = feeds;
  for (auto& [name, tensor] : magnitudes)
    for (double& v : tensor.real) v = std::abs(v);
  const PlanOptions twin{.precision = Precision::Double, .gemm = "packed"};
  return {evaluate(graph, {result}, device, feeds, twin)[0].real,
          evaluate(graph, {result}, device, magnitudes, twin)[0].real};
}

BenchError error_of(const std::vector<float>& found, const BenchTruth& truth) {
  if (truth.values.empty()) return {std::nan(""), std::nan("")};
  BenchError error;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double e = std::abs(found[i] - truth.values[i]) / truth.magnitudes[i];
    error.largest = std::max(error.largest, e), error.rms += e * e;
  }
  error.rms = std::sqrt(error.rms / static_cast<double>(found.size()));
  return error;
}

BenchError largest_error(const BenchRow& row) {
  BenchError largest = row.errors.front();
  for (const BenchError& e : row.errors) largest = {std::max(largest.largest, e.largest), std::max(largest.rms, e.rms)};
  return largest;
}

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
