// The Monte Carlo rendering layer, assembled: for every pixel of a batch, directions drawn by its surface, traced in
// screen space, lit by whatever light is given, averaged. Any size, any batch, bounded memory (map_chunks).
#pragma once
#include <functional>
#include <optional>

#include "host/ops/light/ssrt.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "host/ops/shade/sample_brdf.hpp"

namespace clerestory {

struct RenderSpec {
  int spp = 64;  // at least 2 with statistics; 128 for Sampler::Grid8x16
  SamplingOptions sampling{};
  SsrtOptions ssrt{};
  bool facing = true;  // a cell that faces away from a ray is not hit by it
  bool trace = true;   // false: no ray is traced (a light that does not ask where rays end); u is 0
  int chunk_rays = 1 << 18;
  int every_chunk = 1;     // ChunkDomain::every
  bool statistics = true;  // false: neither standard error nor uncertainty, and then one sample is enough
  Value lamps{};  // of light_guide(), {n or 1, 5, 1, K}: some directions are drawn towards them; none: no guide
};

/// What is shaded. depth {n, 1, h, w}: axial metres, 0 = none.
struct SurfaceMaps {
  Value depth;
  Surfaces surfaces;
};

/// What rays are traced against when it is not the shaded maps themselves: some pixels of a scene are shaded, and their
/// rays meet all of it. skip: Int {n, 1, h, w}, the pixel that a pixel's rays do not hit, its own, or -1.
struct Blockers {
  Value depth, normal, skip;
};

/// What a light counts, by name: Int {1, 1, 1, 1}, added over chunks modulo 2^32. A name may come more than once.
using RayCounts = std::vector<std::pair<std::string, Value>>;

/// One chunk's rays, as a light sees them inside map_chunks.
struct RayBatch {
  Value direction;   // {1, 3, pixels, samples}, camera frame; (0, 0, 0): none
  Lobes lobes;       // how the surface sees them; no values unless RenderSpec::sampling asks for lobes
  SsrtHits hits;     // no values when RenderSpec::trace is false
  SurfaceMaps maps;  // whole maps of the pixels that the rays start from
  Value camera;
  RayCounts* counts = nullptr;  // for the light to append to
};
/// Radiance {1, 3, pixels, samples} along the rays. `inputs`: the whole-map values named to render(), in that order.
using LightBuilder = std::function<Value(Graph& inner, const RayBatch& rays, std::span<const Value> inputs)>;

struct Rendered {
  Value radiance;        // {n, 3, h, w}: reflected light
  Value standard_error;  // {n, 3, h, w}: of it, as independent samples have it (SampleStatistics)
  Value uncertainty;     // {n, 1, h, w}: mean u; neither without RenderSpec::statistics
  Value status;          // {n, 1, h, w}: 0 shaded, 1 no depth, 2 normal faces away
  Value tally;           // {n, 5, h, w}: tally and first of SampleSums
  RayCounts counts;      // what the light counted
};

/// camera {n, 4, 1, 1} and range {n, 3, 1, 1} by camera_tensor() and depth_range() (of the blockers' depth). Detached
/// sampling: `sampling` chooses directions, by default the maps' own values.
Rendered render(Graph& graph, const RenderSpec& spec, const SurfaceMaps& maps, Value camera, Value range,
                std::span<const Value> light_inputs, const LightBuilder& light, const Blockers& blockers = {},
                const Surfaces& sampling = {});

/// Sums over a batch, exact: rays and pixels may be more than float counts.
struct RenderCounts {
  double directions = 0, hits = 0, dropped = 0;           // rays
  double shaded = 0, without_depth = 0, facing_away = 0;  // pixels
  struct Offender {
    long pixel = 0;  // of the batch, row-major
    int sample = 0;
  };
  std::optional<Offender> first_dropped;  // with the run's seed it can be replayed
};
RenderCounts render_counts(const Tensor& status, const Tensor& tally);

/// The same layer with a light that is not a graph: a chunk's rays are made on the device, `fill` writes their
/// radiance, the chunk is summed.
struct HostRays {
  Chunk chunk;
  int pixel_capacity = 0,
      sample_capacity = 0;    // ray (p, s) of channel c lies at offset + (c * pixel_capacity + p) * sample_capacity + s
  TensorView points;          // {n, 3, h, w}: surface points of all pixels, camera metres
  TensorView direction;       // {1, 3, pixel_capacity, sample_capacity}
  TensorView specular, lobe;  // {1, 3, ...} and {1, 1, ...}: Lobes; empty unless RenderSpec::sampling asks for lobes
  TensorView hit_pixel;       // Int {1, 1, ...}; empty when nothing is traced
  TensorView radiance;        // {1, 3, ...}: to be filled
};
struct HostRendered {
  Tensor radiance, standard_error, uncertainty, status, tally;
};
/// `feeds`: depth, normal, albedo, material, camera, range.
HostRendered render_with_host_light(Device device, const RenderSpec& spec, const std::map<std::string, Tensor>& feeds,
                                    std::uint32_t seed, const std::function<void(const HostRays&)>& fill);

}  // namespace clerestory
