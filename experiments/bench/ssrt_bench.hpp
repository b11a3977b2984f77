// Screen-space rays by themselves: rays a second on depth maps with and without order, of three sizes.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "experiments/bench/bench.hpp"

namespace clerestory {

/// Prints a table unless quiet. Sixteen cosine rays of every pixel of sixteen bands spread over the picture, as many in
/// every picture. The result holds for each row (scene, size, with and without FACING, rays side by side) the rays,
/// the share of them that hit, and seconds of runs. Into options.write go, for each scene and size,
/// NAME_WxH.safetensors: depth {h, w}, normal {3, h, w}, camera {4} (fx, fy, cx, cy), pixel {rays} (y * w + x),
/// direction {rays, 3}.
nlohmann::ordered_json bench_ssrt(Device& device, const BenchOptions& options);

}  // namespace clerestory
