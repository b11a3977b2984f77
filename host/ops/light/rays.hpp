// Ray tensors: {1, C, pixels, samples}, samples fastest, a multiple of 16 (kernels/lib/chunk.clh). Inside map_chunks
// they are one chunk; outside, a list whose rows belong to the pixels of the batch in row-major order.
#pragma once
#include "host/graph/op.hpp"

namespace clerestory {

/// How a surface sees the light that rays bring: not who drew them, but what of its weight for each is the specular
/// lobe's (0 to 1, 3 channels; the rest is Lambertian), and that lobe's own density there (1/sr, 1 channel). For light
/// that lobes narrower than itself do not see whole (soft_lamps.hpp). No values: no surface asks, or no light cares.
struct Lobes {
  Value specular, density;
  explicit operator bool() const { return static_cast<bool>(density); }
};

/// Throws Error unless `lobes`, if there are any, are of the rays of `directions`.
void check_lobes(const Lobes& lobes, const Value& directions, const char* op);

/// What of a ray tensor a launch works on: the chunk at hand, outside of map_chunks all of it. In the order of
/// CHUNK_ARGS.
struct RayTile {
  int first_pixel = 0, pixels = 0, first_sample = 0, samples = 0;
  int pixel_capacity = 0, sample_capacity = 0;
};
/// `pixels`: how many the batch has.
RayTile ray_tile(const Launch& launch, const Shape& rays, long pixels = 0x7fffffff);

/// Throws Error unless `rays` is a ray tensor of `channels` channels.
void check_rays(const Value& rays, int channels, const char* op);

/// Throws Error unless `points` belong to the rays of `directions`: {1, 3, P, S}, or {1, 3, P, 1} for whole rows.
void check_points(const Value& points, const Value& directions, const char* op);

/// One work-item per ray, samples along x.
Range ray_range(const RayTile& tile);

}  // namespace clerestory
