// What the device can do: multiply-adds, memory, launches, and what each register tile makes of it.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "experiments/bench/bench.hpp"

namespace clerestory {

/// Prints a table unless quiet. The result holds the ceilings (host/cl/ceilings.hpp), "peak_gflops", the larger of
/// multiply-adds and the best product, and for each tile its GFLOP/s, or why it was not measured or refused.
nlohmann::ordered_json bench_peak(Device& device, const BenchOptions& options);

}  // namespace clerestory
