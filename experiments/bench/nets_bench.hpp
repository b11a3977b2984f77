// Whole nets: trunks forward, training steps, LightNet's MLP forward and backward.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "experiments/bench/bench.hpp"

namespace clerestory {

/// Prints a table unless quiet. The result holds rows {"name", "items" that a run is for, "seconds" (the best) and
/// "runs" (all)}. experiments/peers/torch_nets.py knows the rows by their names.
nlohmann::ordered_json bench_nets(Device& device, const BenchOptions& options);

}  // namespace clerestory
