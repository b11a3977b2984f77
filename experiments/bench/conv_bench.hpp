// Convolution at the shapes of the nets: both backends, all three passes, beside the device's measured peak.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "experiments/bench/bench.hpp"

namespace clerestory {

/// Prints a table unless quiet. The result holds groups of shapes; each shape has the peak measured beside it, the
/// first of the tiles and the best seconds of each pass by tile and, unless it is left out, by "clblast":
/// {"8x48": {"forward", "data", "weights"}, "clblast": {...}}, and by "tuned" where CLBlast is; "runs" likewise has
/// lists of all timed runs, "errors" the largest and the root mean square relative to the sum of magnitudes.
nlohmann::ordered_json bench_conv(Device& device, const BenchOptions& options);

}  // namespace clerestory
