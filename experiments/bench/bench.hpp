// What the families of benchmarks share: what to measure, how long to measure it, and shares of the peak.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "host/cl/tile.hpp"
#include "host/graph/plan.hpp"
#include "host/ops/nn/clblast_parameters.hpp"

namespace clerestory {

struct BenchOptions {
  bool quiet = false;
  std::string own = "packed";      // or "direct": which of our own kernels
  std::vector<std::string> tiles;  // their register tiles (host/cl/tile.hpp), those to be measured
  bool clblast = true;             // beside them: by its own parameters, and tuned where it is
  int runs = 0;                    // timed of everything; 0: ten, or as many as fit into a third of a second
  std::string only;                // conv, nets, ssrt, layer: rows whose name contains this
  bool explain = false;            // nets, layer: what each op or kernel costs
  std::size_t memory = 0;          // nets: budget of each plan, bytes; 0: none
  std::vector<int> lanes = {0};    // ssrt: SsrtOptions::lanes, those to be measured
  std::filesystem::path write;     // ssrt, layer: folder for what a peer needs to do the same; empty: not written
};

/// Wall times of runs, launches counted, after one that compiles and warms up. `runs` as in BenchOptions.
std::vector<double> seconds_of_runs(int runs, const std::function<double()>& seconds_of_one);
std::vector<double> seconds_of_runs(Device& device, Executor& executor, int runs);
double best_of(const std::vector<double>& seconds);

/// Runs `measure` with one tile after the other in force, then with the device's own again.
template <class Measure>
void for_tiles(Device& device, const BenchOptions& options, const Measure& measure) {
  const std::string own = device.tile().name;
  for (const std::string& name : options.tiles) {
    device.use_tile(name);
    measure(name);
  }
  device.use_tile(own);
}

/// Runs `measure` with CLBlast's own parameters ("clblast"), then with those of the tuning in use, if it has some
/// ("tuned").
template <class Measure>
void for_clblast(Device& device, const BenchOptions& options, const Measure& measure) {
  if (!options.clblast) return;
  use_clblast_parameters(device, {});
  measure("clblast");
  const ClblastParameters tuned = tuned_parameters(device);
  use_clblast_parameters(device, tuned);
  if (!tuned.empty()) measure("tuned");
}

/// How far sums in float are from the same in double, relative to the sums of the magnitudes of what they add.
struct BenchError {
  double largest = 0, rms = 0;
};

/// What a graph gives in double, and given the magnitudes of its inputs: of sums of products, what errors are relative
/// to. Both are empty on a device without doubles.
struct BenchTruth {
  std::vector<double> values, magnitudes;
};
BenchTruth truth_of(Device& device, const Graph& graph, Value result, const std::map<std::string, Tensor>& feeds);
/// NaN without a truth.
BenchError error_of(const std::vector<float>& found, const BenchTruth& truth);

/// Seconds of each of a benchmark's passes, by what ran them: a tile, "clblast" or "tuned".
struct BenchRow {
  std::string kernels;
  std::vector<std::vector<double>> passes;  // of each its runs
  std::vector<BenchError> errors = {};      // of each, where they are measured
};
/// The largest of the passes.
BenchError largest_error(const BenchRow& row);

/// 10^9 a second: the larger of multiply-adds measured just before and of the best among the rows.
double peak_gflops(double fma_gflops, double flops, const std::vector<BenchRow>& rows);

/// "    1.23    340  77%" for each pass of a row: milliseconds, GFLOP/s, share of the peak.
std::string row_text(const BenchRow& row, double flops, double peak);

/// Values that look like noise, in [-size, size).
Tensor noise(const Shape& shape, std::uint32_t seed, double size = 1);

}  // namespace clerestory
