// Soft lamps: Gaussian blobs of radiance that a photograph does not show. From a point at distance r, along a direction
// at angle theta from the lamp's middle, lamp k gives
//   shape_k = exp(-(r / size)^2 (1 - cos theta)),   about exp(-(r theta)^2 / (2 size^2)),
// a spherical Gaussian whose sharpness is that of a blob of that size in space: light falls with the distance as it does
// from a sphere, and is never more than the lamp's own radiance however near it is.
// Lamps are found by what they do to surfaces, so that little is known of their edges: no lobe may see a lamp more sharply
// than the lamp is known. A surface's Lambertian part sees it whole. Its specular lobe has the density d (1/sr) of its own
// at the ray, which is a matter of surface and direction, not of whoever draws; where that is more than one over a lamp's
// solid angle, of at most the cosine lobe's, 2 pi / (2 + lambda) with lambda = (r / size)^2, it counts as that:
//   share_k = min(1, (2 + lambda) / (2 pi d)).
// A rough lobe sees the whole lamp, a mirror none, or it would show blobs. Of what a ray brings, with `specular` the lobe's
// share of the surface's weight for it, color_k shape_k (1 - specular (1 - share_k)) remains.
// places {1, 4, 1, K}: middle (camera metres), size > 0; colors {1, 3, 1, K}; points {1, 3, P, S} or, when they belong to
// whole rows, {1, 3, P, 1}; direction {1, 3, P, S} of any length, (0, 0, 0): none; u {1, 1, P, S} (kernels/lib/chunk.clh);
// with LOBES specular {1, 3, P, S} and lobe {1, 1, P, S}, d (0: sees all), else no surface asks.
// A work-group takes a row of rays (lib/lanes.clh); ROW_STARTS: points belong to whole rows.
#include "lib/chunk.clh"
#include "lib/frame.clh"
#include "lib/lanes.clh"

#ifdef LOBES
#define RAYS_ARGS IN(points), IN(direction), IN(u), IN(places), IN(specular), IN(lobe), const int lamps
#define LOBE_OF_RAY(s) lanes_load(AT(lobe, 0) + RAY(p, s), sample_capacity - (s))
#define SPECULAR_OF_RAY(s) lanes3_load(AT(specular, 0) + RAY(p, s), RAY_PLANE, sample_capacity - (s))
#else
#define RAYS_ARGS IN(points), IN(direction), IN(u), IN(places), const int lamps
#define LOBE_OF_RAY(s) ((lanes)(R(0)))
#define SPECULAR_OF_RAY(s) ((Lanes3){{(lanes)(R(0)), (lanes)(R(0)), (lanes)(R(0))}})
#endif

// Where rays start, and what follows from that alone: one number for all lanes where the row has one point.
#ifdef ROW_STARTS
typedef real starts;
#else
typedef lanes starts;
#endif

// Rays as lamps see them: where they start, their unit direction, u where there is a ray, else 0, and how wide a lobe is
// behind them, 1 / (2 pi d), 0 for one that sees all.
typedef struct {
  starts from[3];
  Lanes3 along;
  lanes share, width;
} LitRays;

static inline LitRays lit_rays(global const real *points, global const real *direction, global const real *u, lanes lobe,
                               ulong row, ulong ray, ulong rows, ulong plane, int left) {
  LitRays lit;
#ifdef ROW_STARTS
  for (int c = 0; c < 3; ++c) lit.from[c] = points[c * rows + row];
#else
  for (int c = 0; c < 3; ++c) lit.from[c] = lanes_load(points + c * plane + ray, left);
#endif
  const Lanes3 d = lanes3_load(direction + ray, plane, left);
  const lanes size = sqrt(d.c[0] * d.c[0] + d.c[1] * d.c[1] + d.c[2] * d.c[2]);
  const lanes_mask is = size > R(0);
  const lanes scale = R(1) / WHERE(is, size, R(1));
  for (int c = 0; c < 3; ++c) lit.along.c[c] = d.c[c] * scale;
  lit.share = WHERE(is, lanes_load(u + ray, left), R(0));
  lit.width = WHERE(lobe > R(0), R(0.5) * INV_PI / lobe, R(0));
  return lit;
}
#define LIT_RAYS(s)                                                                                                      \
  lit_rays(AT(points, 0), AT(direction, 0), AT(u, 0), LOBE_OF_RAY(s), (ulong)p, RAY(p, s), (ulong)pixel_capacity, \
           RAY_PLANE, sample_capacity - (s))

// A lamp along rays: its shape, and the share of it that lobes see.
typedef struct {
  lanes shape, seen;
} SeenLamp;

// Logarithm of the least shape that counts: 1e-26 of a lamp's radiance. What is less would soon be subnormal, and then a
// CPU takes some hundred cycles for a product.
#define LEAST_LOG_SHAPE R(-60)

// 1 - cos theta as half the squared chord: exact where the angle is small.
static inline SeenLamp seen_lamp(const LitRays lit, global const real *places, int lamps, int k) {
  const real size = places[3 * lamps + k], sharpness = R(1) / (size * size);
  starts to[3];
  for (int c = 0; c < 3; ++c) to[c] = places[c * lamps + k] - lit.from[c];
  const starts square = to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
  const starts nearness = R(1) / fmax(sqrt(square), (starts)(R(1e-30)));
  const starts steepness = R(-0.5) * sharpness * square, widest = R(2) + square * sharpness;
  lanes chord = R(0);
  for (int c = 0; c < 3; ++c) {
    const lanes apart = to[c] * nearness - lit.along.c[c];
    chord += apart * apart;
  }
  const lanes widths = widest * lit.width;
  const lanes log_shape = steepness * chord;
  const lanes shape = exp(WHERE(log_shape < LEAST_LOG_SHAPE, R(LEAST_LOG_SHAPE), log_shape));
  return (SeenLamp){WHERE(log_shape <= LEAST_LOG_SHAPE, R(0), shape),  // a NaN stays one
                    WHERE(lit.width > R(0), fmin(widths, (lanes)(R(1))), R(1))};
}

// y = x + u sum_k color_k shape_k (1 - specular (1 - share_k)).
kernel void add_lamps(IN(x), IN(colors), OUT(y), RAYS_ARGS, CHUNK_ARGS) {
  const int p = (int)get_group_id(0);
  global const real *color = AT(colors, 0);
  FOR_ROW(s, sample_capacity) {
    const LitRays lit = LIT_RAYS(s);
    const Lanes3 specular = SPECULAR_OF_RAY(s);
    lanes whole[3] = {R(0), R(0), R(0)}, in_lobe[3] = {R(0), R(0), R(0)};
    if (lanes_any(lit.share > R(0)))
      for (int k = 0; k < lamps; ++k) {
        const SeenLamp lamp = seen_lamp(lit, AT(places, 0), lamps, k);
        const lanes narrow = lamp.shape * lamp.seen;
        for (int c = 0; c < 3; ++c) {
          whole[c] += color[c * lamps + k] * lamp.shape;
          in_lobe[c] += color[c * lamps + k] * narrow;
        }
      }
    for (int c = 0; c < 3; ++c) {
      const ulong at = c * RAY_PLANE + RAY(p, s);
      const int left = sample_capacity - s;
      const lanes sum = (R(1) - specular.c[c]) * whole[c] + specular.c[c] * in_lobe[c];
      lanes_store(lanes_load(AT(x, 0) + at, left) + lit.share * sum, AT(y, 0) + at, left);
    }
  }
}

#ifdef LOBES
// What lobes give, from dy = weight {1, 3, P, S}: to `specular` - dy u sum_k color_k shape_k (1 - share_k), and to the
// lobe's density what share_k gives, d share_k / d d = - share_k / d where it is less than 1.
kernel void add_lamps_adjoint(IN(weight), IN(colors), OUT(d_specular), OUT(d_lobe), RAYS_ARGS, CHUNK_ARGS) {
  const int p = (int)get_group_id(0);
  global const real *color = AT(colors, 0);
  FOR_ROW(s, sample_capacity) {
    const LitRays lit = LIT_RAYS(s);
    const Lanes3 specular = SPECULAR_OF_RAY(s);
    const int left = sample_capacity - s;
    lanes hidden[3] = {R(0), R(0), R(0)}, cut[3] = {R(0), R(0), R(0)};
    if (lanes_any(lit.share > R(0)))
      for (int k = 0; k < lamps; ++k) {
        const SeenLamp lamp = seen_lamp(lit, AT(places, 0), lamps, k);
        const lanes missed = lamp.shape * (R(1) - lamp.seen);
        const lanes narrow = WHERE(lamp.seen < R(1), lamp.shape * lamp.seen, R(0));
        for (int c = 0; c < 3; ++c) {
          hidden[c] += color[c * lamps + k] * missed;
          cut[c] += color[c * lamps + k] * narrow;
        }
      }
    lanes to_density = R(0);
    for (int c = 0; c < 3; ++c) {
      const ulong at = c * RAY_PLANE + RAY(p, s);
      const lanes arriving = lit.share * lanes_load(AT(weight, 0) + at, left);
      to_density += arriving * specular.c[c] * cut[c];
      lanes_store(-arriving * hidden[c], AT(d_specular, 0) + at, left);
    }
    lanes_store(to_density * lit.width * (R(-2) * PI), AT(d_lobe, 0) + RAY(p, s), left);
  }
}
#endif

// y {P, 3, 1, K}: what one unit of lamp k adds to row p, the sum over its rays of weight u shape_k (1 - specular
// (1 - share_k)). The adjoint of add_lamps by its colors is this of dy, summed over rows.
kernel void weigh_lamps(IN(weight), OUT(y), RAYS_ARGS, CHUNK_ARGS) {
  GROUP_SCRATCH(scratch);
  const int k = (int)get_group_id(0);
  const int p = (int)get_group_id(1);
  lanes sum[3] = {R(0), R(0), R(0)};
  if (p < pixels)
    FOR_ROW(s, samples) {
      const LitRays lit = LIT_RAYS(s);
      const Lanes3 specular = SPECULAR_OF_RAY(s);
      const SeenLamp lamp = seen_lamp(lit, AT(places, 0), lamps, k);
      for (int c = 0; c < 3; ++c) {
        const lanes share = lit.share * lamp.shape * ((R(1) - specular.c[c]) + specular.c[c] * lamp.seen);
        const lanes weighed = share * lanes_load(AT(weight, 0) + c * RAY_PLANE + RAY(p, s), sample_capacity - s);
        sum[c] += lanes_inside(weighed, samples - s);
      }
    }
  for (int c = 0; c < 3; ++c) {
    const real all = group_sum(sum[c], scratch);
    if (get_local_id(0) == 0) AT(y, p)[c * lamps + k] = all;
  }
}
