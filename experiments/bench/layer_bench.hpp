// The Monte Carlo layer and its gradients, of a room that does not change: seconds, and memory by samples.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "experiments/bench/bench.hpp"

namespace clerestory {

/// Prints a table unless quiet. The room is lit by a map of radiance ("given"), which rays read where they end, or by
/// the compact preset's nets with random states ("learned"). "picture": forward; "gradients": forward and adjoint for
/// all that is given (albedo, normal, roughness, metallic, and the map of radiance). The result holds for each row its
/// size, samples, seconds of runs, the rays traced within one and the seconds of that, and the bytes of device memory
/// held at most. Into options.write goes layer.safetensors: the scene, and a run's picture and gradients in float and,
/// where the device has it, in double.
nlohmann::ordered_json bench_layer(Device& device, const BenchOptions& options);

}  // namespace clerestory
