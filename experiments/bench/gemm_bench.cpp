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

/// A product with what it gives in double.
struct ExactProduct {
  Graph graph;
  Value result;
  std::map<std::string, Tensor> feeds;
  BenchTruth truth;

  ExactProduct(Device& device, const std::array<int, 3>& shape) {
    const auto [rows, columns, depth] = shape;
    const Value a = graph.input("a", {1, 1, rows, depth}), b = graph.input("b", {1, 1, depth, columns});
    result = matmul(a, b);
    feeds = {{"a", noise(a.shape(), 1)}, {"b", noise(b.shape(), 2)}};
    truth = truth_of(device, graph, result, feeds);
  }
};

BenchRow measured_product(Device& device, const ExactProduct& product, const std::string& gemm, const std::string& name,
                          int runs) {
  Executor executor(compile(product.graph, {product.result}, device, {.gemm = gemm}));
  for (const auto& [input, tensor] : product.feeds) executor.feed(input, tensor);
  BenchRow row{name, {seconds_of_runs(device, executor, runs)}};
  row.errors = {error_of(executor.fetch_floats(product.result), product.truth)};
  return row;
}

}  // namespace

nlohmann::ordered_json bench_gemm(Device& device, const BenchOptions& options) {
  nlohmann::ordered_json result{{"device", device.info().name}, {"shapes", nlohmann::ordered_json::array()}};
  if (!options.quiet)
    fmt::print(
        "Products, packing counted; errors against double, relative to the sum of magnitudes\n"
        "{:>6}{:>8}{:>7}{:>7}  {:<8}{:>12}{:>7}{:>5}{:>11}{:>9}\n",
        "rows", "columns", "depth", "peak", "kernels", "ms", "GFLOP/s", "peak", "largest", "rms");
  for (const std::array<int, 3>& shape : kShapes) {
    const auto [rows, columns, depth] = shape;
    const double flops = 2.0 * rows * columns * depth, fma = measure_ceilings(device).fma_gflops;
    const ExactProduct product(device, shape);
    std::vector<BenchRow> measured;
    for_tiles(device, options, [&](const std::string& tile) {
      measured.push_back(measured_product(device, product, "packed", tile, options.runs));
    });
    for_clblast(device, options, [&](const std::string& name) {
      measured.push_back(measured_product(device, product, "clblast", name, options.runs));
    });
    const double peak = peak_gflops(fma, flops, measured);
    nlohmann::ordered_json seconds, runs, errors;
    for (const BenchRow& row : measured) {
      const BenchError& error = row.errors[0];
      seconds[row.kernels] = best_of(row.passes[0]), runs[row.kernels] = row.passes[0];
      errors[row.kernels] = {{"largest", error.largest}, {"rms", error.rms}};
      if (!options.quiet)
        fmt::print("{:>6}{:>8}{:>7}{:>7.0f}  {:<8}{}{:>11.1e}{:>9.1e}\n", rows, columns, depth, peak, row.kernels,
                   row_text(row, flops, peak), error.largest, error.rms);
    }
    std::fflush(stdout);
    result["shapes"].push_back({{"rows", rows},
                                {"columns", columns},
                                {"depth", depth},
                                {"flops", flops},
                                {"peak_gflops", peak},
                                {"seconds", seconds},
                                {"runs", runs},
                                {"errors", errors}});
  }
  return result;
}

}  // namespace clerestory
