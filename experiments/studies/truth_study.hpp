// The layer under true light against the tracer, and the lights that a photograph allows beside that truth, in
// generated rooms with true maps.
//
// `light = truth` is the tracer's radiance along the layer's rays. What pixels emit themselves is left out of every
// picture compared, and so are the pixels that show an emitter. Two comparisons follow.
// Emitters left out: rays bring what surfaces reflect; the tracer's picture is that of all paths less, at equal seeds,
// that of paths with one scattering (its direct light). No lamp is hit by chance, so values are nearly normal; the
// tracer's take more samples to be so, as its roulette sets in one bounce nearer to the viewer.
// With emitters: rays that end on an emitter bring its emission, which makes direct light; the tracer's picture is that
// of all paths. Unbiased too, but small lamps are hit by few samples: skewed values, which miss their limits more often
// than the level says.
#pragma once
#include <string>
#include <vector>

#include "experiments/studies/agreement.hpp"
#include "host/cl/device.hpp"
#include "host/io/config.hpp"
#include "nets/scene.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// Keys of its own.
void add_truth_keys(Schema& schema);

/// study.kind = "truth". Returns the run directory.
std::string run_truth_study(const Config& config, const std::vector<std::string>& command);

struct TruthOptions {
  int batches = 16, layer_spp = 512, picture_spp = 1024;  // samples a pixel of one batch
  double level = 0.9975;
  std::uint64_t seed = 0;
};

struct TruthComparison {
  Agreement reflected, whole;  // emitters left out; with emitters
  double whole_by_stated = 0;  // share within the limits of the layer's own standard errors and the tracer's variances
  Image layer, tracer;         // means of all batches, `layer` without emission
  std::vector<bool> used;      // pixels compared
  double dropped = 0;          // samples and paths that were not finite
};

/// `scene`: scene_of(traced.maps(camera), camera).
TruthComparison compare_with_tracer(Device& device, TraceScene& traced, const Scene& scene,
                                    const TruthOptions& options);

}  // namespace clerestory
