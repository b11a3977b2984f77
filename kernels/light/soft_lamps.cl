// Soft lamps: Gaussian blobs of radiance that a photograph does not show. From a point at distance r, along a direction
// at angle theta from the lamp's middle, lamp k gives
//   shape_k = exp(-(r / size)^2 (1 - cos theta)),   about exp(-(r theta)^2 / (2 size^2)),
// a spherical Gaussian whose sharpness is that of a blob of that size in space: light falls with the distance as it does
// from a sphere, and is never more than the lamp's own radiance however near it is.
// Lamps are found by what they do to surfaces, so that little is known of their edges. A ray drawn from a lobe narrower
// than the lamp is does not see it whole, or mirrors would show blobs: with the ray's pdf (1/sr; 0: no surface asks),
// lambda = (r / size)^2 and a lamp's solid angle of at most the cosine lobe's, 2 pi / (2 + lambda),
//   share_k = min(1, (2 + lambda) / (2 pi pdf)),   which is 1 for any Lambertian surface.
// places {1, 4, 1, K}: middle (camera metres), size > 0; colors {1, 3, 1, K}; points {1, 3, P, S} or, when they belong to
// whole rows, {1, 3, P, 1}; direction {1, 3, P, S} of any length, (0, 0, 0): none; u and pdf {1, 1, P, S} (kernels/lib/chunk.clh).
// A work-group takes a row of rays (lib/lanes.clh).
#include "lib/chunk.clh"
#include "lib/frame.clh"
#include "lib/lanes.clh"

#define RAYS_ARGS IN(points), IN(direction), IN(u), IN(pdf), IN(places), const int lamps, const int per_row

typedef struct {
  lanes x, y, z;
} Lanes3;

static inline Lanes3 load3(global const real *v, ulong plane, int left) {
  return (Lanes3){lanes_load(v, left), lanes_load(v + plane, left), lanes_load(v + 2 * plane, left)};
}

// Rays as lamps see them: where they start, their unit direction, u where there is a ray, else 0, and how wide a lobe is
// behind them, 1 / (2 pi pdf).
typedef struct {
  Lanes3 from, along;
  lanes share, width;
} LitRays;

static inline LitRays lit_rays(global const real *points, global const real *direction, global const real *u, global const real *pdf,
                               int per_row, ulong row, ulong ray, ulong rows, ulong plane, int left) {
  LitRays lit;
  if (per_row)
    lit.from = (Lanes3){(lanes)(points[row]), (lanes)(points[rows + row]), (lanes)(points[2 * rows + row])};
  else
    lit.from = load3(points + ray, plane, left);
  const Lanes3 d = load3(direction + ray, plane, left);
  const lanes size = sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  const lanes_mask is = size > R(0);
  const lanes scale = R(1) / WHERE(is, size, R(1));
  lit.along = (Lanes3){d.x * scale, d.y * scale, d.z * scale};
  lit.share = WHERE(is, lanes_load(u + ray, left), R(0));
  const lanes density = lanes_load(pdf + ray, left);
  lit.width = WHERE(density > R(0), R(0.5) * INV_PI / density, (lanes)(R(1)));  // no surface: all of any lamp
  return lit;
}
#define LIT_RAYS(s)                                                                                                 \
  lit_rays(AT(points, 0), AT(direction, 0), AT(u, 0), AT(pdf, 0), per_row, (ulong)p, RAY(p, s), (ulong)pixel_capacity, RAY_PLANE, \
           sample_capacity - (s))

// 1 - cos theta as half the squared chord: exact where the angle is small.
static inline lanes lamp_shape(const LitRays lit, global const real *places, int lamps, int k) {
  const real size = places[3 * lamps + k], sharpness = R(-0.5) / (size * size);
  const lanes x = places[k] - lit.from.x, y = places[lamps + k] - lit.from.y, z = places[2 * lamps + k] - lit.from.z;
  const lanes square = x * x + y * y + z * z, nearness = R(1) / fmax(sqrt(square), (lanes)(R(1e-30)));
  const lanes a = x * nearness - lit.along.x, b = y * nearness - lit.along.y, c = z * nearness - lit.along.z;
  const lanes seen = fmin((lanes)(R(1)), (R(2) + square / (size * size)) * lit.width);
  return seen * exp(sharpness * square * (a * a + b * b + c * c));
}

// y = x + u sum_k color_k shape_k.
kernel void add_lamps(IN(x), IN(colors), OUT(y), RAYS_ARGS, CHUNK_ARGS) {
  const int p = (int)get_group_id(0);
  global const real *color = AT(colors, 0);
  FOR_ROW(s, sample_capacity) {
    const LitRays lit = LIT_RAYS(s);
    lanes sum[3] = {R(0), R(0), R(0)};
    if (lanes_any(lit.share > R(0)))
      for (int k = 0; k < lamps; ++k) {
        const lanes shape = lamp_shape(lit, AT(places, 0), lamps, k);
        for (int c = 0; c < 3; ++c) sum[c] += color[c * lamps + k] * shape;
      }
    for (int c = 0; c < 3; ++c) {
      const ulong at = c * RAY_PLANE + RAY(p, s);
      const int left = sample_capacity - s;
      lanes_store(lanes_load(AT(x, 0) + at, left) + lit.share * sum[c], AT(y, 0) + at, left);
    }
  }
}

// y {P, 3, 1, K}: what one unit of lamp k adds to row p, the sum over its rays of weight u shape_k. The adjoint of
// add_lamps by its colors is this of dy, summed over rows.
kernel void weigh_lamps(IN(weight), OUT(y), RAYS_ARGS, CHUNK_ARGS) {
  GROUP_SCRATCH(scratch);
  const int k = (int)get_group_id(0);
  const int p = (int)get_group_id(1);
  lanes sum[3] = {R(0), R(0), R(0)};
  if (p < pixels)
    FOR_ROW(s, samples) {
      const LitRays lit = LIT_RAYS(s);
      const lanes share = lit.share * lamp_shape(lit, AT(places, 0), lamps, k);
      for (int c = 0; c < 3; ++c) {
        const lanes weighed = share * lanes_load(AT(weight, 0) + c * RAY_PLANE + RAY(p, s), sample_capacity - s);
        sum[c] += lanes_inside(weighed, samples - s);
      }
    }
  for (int c = 0; c < 3; ++c) {
    const real all = group_sum(sum[c], scratch);
    if (get_local_id(0) == 0) AT(y, p)[c * lamps + k] = all;
  }
}
