// Directions drawn for every pixel by its surface, and their weights (kernels/shade/sample_brdf.cl, lib/ggx.clh).
#pragma once
#include <string>

#include "host/graph/graph.hpp"
#include "host/ops/light/rays.hpp"

namespace clerestory {

/// The mixtures draw the specular lobe by visible normals (three ways) or all normals, and the cosine lobe at least one
/// time in ten; Cosine and Uniform are single lobes; Grid8x16 is the fixed grid of Li et al. 2020: 128 samples.
/// NdfRoughness is a mixture like Ndf whose normals are, half of them, those for which the lobe changes with roughness
/// (after Belhe et al. 2024): for gradients.
enum class Sampler { VndfCaps, VndfHemisphere, VndfBounded, Ndf, Cosine, Uniform, Grid8x16, NdfRoughness };
enum class Points { Independent, Sobol };
enum class BrdfModel { Ggx, Li2020 };

Sampler sampler_of(const std::string& name);       // vndf_caps | ... | ndf_roughness; throws usage_error
Points points_of(const std::string& name);         // independent | sobol; throws usage_error
BrdfModel brdf_model_of(const std::string& name);  // ggx | li2020; throws usage_error

struct SamplingOptions {
  Sampler sampler = Sampler::VndfCaps;
  Points points = Points::Sobol;
  BrdfModel brdf = BrdfModel::Ggx;
  bool lobes = false;  // BrdfSamples::lobes: the weight in its two parts, for lights that ask
};

/// What says in kernels which sampler and points draw.
Defines sampler_defines(const SamplingOptions& options);

/// Maps that describe surfaces, all {n, C, h, w}: albedo 3 (linear), normal 3 (camera frame; any length but zero),
/// material 2 or more (roughness, metallic, ...).
struct Surfaces {
  Value albedo, normal, material;
};

struct BrdfSamples {
  Value direction;  // {1, 3, pixels, samples}: camera frame, unit; (0, 0, 0): none
  Value weight;     // {1, 3, pixels, samples}: f cos / pdf; 0 where there is no direction
  Value pdf;        // {1, 1, pixels, samples}: 1/sr; 0 where there is no direction
  Value status;     // {1, 1, pixels, 1}: 0 shaded, 1 no depth, 2 normal faces away from the viewer
  Lobes lobes;      // weight * specular is the specular lobe's part of it, weight * (1 - specular) the Lambertian's
};

/// Samples of a chunk of `pixels` x `samples` (multiple of 16) rays. `sampling` maps choose directions, lobes and pdf
/// and are detached; `weight` and `lobes` are functions of the `evaluation` maps (by default the same), to which their
/// gradients go as those of f cos over a fixed pdf. The adjoint draws each ray again, from the seed.
/// depth {n, 1, h, w} (0 = no surface), camera {n, 4, 1, 1}. Random numbers: (run seed, pixel, sample).
/// `guide`: rows of light_guide() for these pixels, or none. With one, some directions are drawn towards lamps and the
/// others by the sampler, and pdf is that of both together. Not for Grid8x16.
BrdfSamples sample_brdf(Value depth, Value camera, const Surfaces& sampling, const Surfaces& evaluation, int pixels,
                        int samples, const SamplingOptions& options = {}, Value guide = {});

/// A guide's row (kernels/lib/guide.clh): numbers before its lobes, and of each of them.
constexpr int kGuideHead = 2, kGuideLobe = 6;

}  // namespace clerestory
