// The learned light at inference: each net in one kernel beside the same net composed of ops, and the device's peak.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "experiments/bench/bench.hpp"
#include "nets/mixed_light.hpp"

namespace clerestory {

/// Prints a table unless quiet. The result holds, per net, the work of a ray (FLOP of its products), the peak
/// measured just before (GFLOP/s of float multiply-adds), and seconds for `rays` rays of the fused kernel and of the
/// ops.
nlohmann::ordered_json bench_light(Device& device, const BenchOptions& options);

/// Likewise the nets in one kernel alone, in one register tile after the other: seconds by tile.
nlohmann::ordered_json bench_mlp(Device& device, const BenchOptions& options);

/// Seconds for a million rays at inference, the nets' work once per picture left out: LightNet's MLP in one kernel; the
/// out-of-view field likewise, or its shells.
struct RaySeconds {
  double in_view = 0, out_of_view = 0;
};
RaySeconds light_ray_seconds(Device& device, const LightSizes& sizes);

}  // namespace clerestory
