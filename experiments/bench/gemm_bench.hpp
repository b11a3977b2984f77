// Matrix products at the shapes of the nets, beside the device's measured peak.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "experiments/bench/bench.hpp"

namespace clerestory {

/// Prints a table unless quiet. The result holds shapes (rows, columns, depth), each with the peak measured beside it
/// and the best seconds by tile and, unless it is left out, by "clblast", and by "tuned" where CLBlast is; packing is
/// counted. "errors" likewise: the largest and the root mean square, relative to the sum of magnitudes.
nlohmann::ordered_json bench_gemm(Device& device, const BenchOptions& options);

}  // namespace clerestory
