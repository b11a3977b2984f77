// Soft lamps: Gaussian blobs of radiance that a photograph does not show. From a point at distance r, along a direction
// at angle theta from the lamp's middle, lamp k gives
//   shape_k = exp(-(r / size)^2 (1 - cos theta)),   about exp(-(r theta)^2 / (2 size^2)),
// a spherical Gaussian whose sharpness is that of a blob of that size in space: light falls with the distance as it does
// from a sphere, and is never more than the lamp's own radiance however near it is.
// places {1, 4, 1, K}: middle (camera metres), size > 0; colors {1, 3, 1, K}; points {1, 3, P, S} or, when they belong to
// whole rows, {1, 3, P, 1}; direction {1, 3, P, S} of any length, (0, 0, 0): none; u {1, 1, P, S} (kernels/lib/chunk.clh).
#include "lib/chunk.clh"
#include "lib/frame.clh"

#define RAYS_ARGS IN(points), IN(direction), IN(u), IN(places), const int lamps, const int per_row

static inline real3 vector_of(global const real *v, ulong plane) { return (real3)(v[0], v[plane], v[2 * plane]); }

// 1 - cos theta as half the squared chord: exact where the angle is small.
static inline real lamp_shape(real3 from, real3 d, global const real *places, int lamps, int k) {
  const real3 to = vector_of(places + k, lamps) - from;
  const real r = sqrt(dot3(to, to)), over = r / places[3 * lamps + k];
  const real3 chord = to / fmax(r, R(1e-30)) - d;
  return exp(R(-0.5) * over * over * dot3(chord, chord));
}

// y = x + u sum_k color_k shape_k.
kernel void add_lamps(IN(x), IN(colors), OUT(y), RAYS_ARGS, CHUNK_ARGS) {
  RAY_OF_WORK_ITEM
  const real3 from = per_row ? vector_of(AT(points, 0) + p, (ulong)pixel_capacity)
                             : vector_of(AT(points, 0) + ray, RAY_PLANE);
  const real3 along = vector_of(AT(direction, 0) + ray, RAY_PLANE);
  const real size = sqrt(dot3(along, along)), share = AT(u, 0)[ray];
  real sum[3] = {R(0), R(0), R(0)};
  if (size > R(0) && share > R(0)) {
    for (int k = 0; k < lamps; ++k) {
      const real shape = lamp_shape(from, along / size, AT(places, 0), lamps, k);
      for (int c = 0; c < 3; ++c) sum[c] += AT(colors, 0)[c * lamps + k] * shape;
    }
  }
  for (int c = 0; c < 3; ++c) AT(y, 0)[c * RAY_PLANE + ray] = AT(x, 0)[c * RAY_PLANE + ray] + share * sum[c];
}

// y {P, 3, 1, K}: what one unit of lamp k adds to row p, the sum over its rays of weight u shape_k, in their order. The
// adjoint of add_lamps by its colors is this of dy, summed over rows.
kernel void weigh_lamps(IN(weight), OUT(y), RAYS_ARGS, CHUNK_ARGS) {
  const int k = (int)get_global_id(0);
  const int p = (int)get_global_id(1);
  if (k >= lamps || p >= pixel_capacity) return;
  real sum[3] = {R(0), R(0), R(0)};
  for (int s = 0; s < samples && p < pixels; ++s) {
    const ulong ray = RAY(p, s);
    const real3 along = vector_of(AT(direction, 0) + ray, RAY_PLANE);
    const real size = sqrt(dot3(along, along));
    if (size <= R(0)) continue;
    const real3 from = per_row ? vector_of(AT(points, 0) + p, (ulong)pixel_capacity)
                               : vector_of(AT(points, 0) + ray, RAY_PLANE);
    const real share = AT(u, 0)[ray] * lamp_shape(from, along / size, AT(places, 0), lamps, k);
    for (int c = 0; c < 3; ++c) sum[c] += AT(weight, 0)[c * RAY_PLANE + ray] * share;
  }
  for (int c = 0; c < 3; ++c) AT(y, p)[c * lamps + k] = sum[c];
}
