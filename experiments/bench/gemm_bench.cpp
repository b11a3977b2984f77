#include "experiments/bench/gemm_bench.hpp"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/cl/ceilings.hpp"
#include "host/ops/nn/gemm.hpp"

namespace clerestory {
namespace {

/// Rows, columns, depth: square ones, and those of DenseNet's and ResNet's layers on small pictures.
constexpr std::array<std::array<int, 3>, 8> kShapes{{{512, 512, 512},
                                                     {1024, 1024, 1024},
                                                     {64, 19200, 576},
                                                     {128, 4800, 1152},
                                                     {256, 1200, 2304},
                                                     {512, 300, 4608},
                                                     {128, 19200, 256},
                                                     {32, 19200, 1152}}};

std::vector<double> product_seconds(Device& device, const std::array<int, 3>& shape, const std::string& gemm,
                                    int runs) {
  const auto [rows, columns, depth] = shape;
  Graph g;
  const Value a = g.input("a", {1, 1, rows, depth}), b = g.input("b", {1, 1, depth, columns});
  Executor executor(compile(g, {matmul(a, b)}, device, {.gemm = gemm}));
  executor.feed("a", noise(a.shape(), 1)), executor.feed("b", noise(b.shape(), 2));
  return seconds_of_runs(device, executor, runs);
}

}  // namespace

nlohmann::ordered_json bench_gemm(Device& device, const BenchOptions& options) {
  nlohmann::ordered_json result{{"device", device.info().name}, {"shapes", nlohmann::ordered_json::array()}};
  if (!options.quiet)
    fmt::print("Products, packing counted\n{:>6}{:>8}{:>7}{:>7}  {:<8}{:>12}{:>7}{:>5}\n", "rows", "columns", "depth",
               "peak", "kernels", "ms", "GFLOP/s", "peak");
  for (const std::array<int, 3>& shape : kShapes) {
    const auto [rows, columns, depth] = shape;
    const double flops = 2.0 * rows * columns * depth, fma = measure_ceilings(device).fma_gflops;
    std::vector<BenchRow> measured;
    for_tiles(device, options, [&](const std::string& tile) {
      measured.push_back({tile, {product_seconds(device, shape, "packed", options.runs)}});
    });
    if (options.clblast) measured.push_back({"clblast", {product_seconds(device, shape, "clblast", options.runs)}});
    const double peak = peak_gflops(fma, flops, measured);
    nlohmann::ordered_json seconds, runs;
    for (const BenchRow& row : measured) {
      seconds[row.kernels] = best_of(row.passes[0]), runs[row.kernels] = row.passes[0];
      if (!options.quiet)
        fmt::print("{:>6}{:>8}{:>7}{:>7.0f}  {:<8}{}\n", rows, columns, depth, peak, row.kernels,
                   row_text(row, flops, peak));
    }
    std::fflush(stdout);
    result["shapes"].push_back({{"rows", rows},
                                {"columns", columns},
                                {"depth", depth},
                                {"flops", flops},
                                {"peak_gflops", peak},
                                {"seconds", seconds},
                                {"runs", runs}});
  }
  return result;
}

}  // namespace clerestory
