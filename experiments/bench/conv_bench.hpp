// Convolution at the shapes of the nets: both backends, all three passes, beside the device's measured peak.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "host/cl/device.hpp"

namespace clerestory {

/// Prints a table unless `quiet`. The result holds groups of shapes; each shape has the peak measured just before it
/// (GFLOP/s of float multiply-adds) and the best seconds of each pass: {"packed": {"forward", "data", "weights"},
/// "clblast": {...}}.
nlohmann::ordered_json bench_conv(Device& device, bool quiet);

}  // namespace clerestory
