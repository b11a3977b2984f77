// The learned light at inference: each net in one kernel beside the same net composed of ops, and the device's peak.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "host/cl/device.hpp"

namespace clerestory {

/// Prints a table unless `quiet`. The result holds, per net, the work of a ray (FLOP of its products), the peak
/// measured just before (GFLOP/s of float multiply-adds), and seconds for `rays` rays of the fused kernel and of the
/// ops.
nlohmann::ordered_json bench_light(Device& device, bool quiet);

}  // namespace clerestory
