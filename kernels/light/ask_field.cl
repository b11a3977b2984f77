// Light from a radiance field in one kernel (Zhu et al. 2022, section 4.3): march (light/march.cl), positional encoding
// [x, sin(2^k x), cos(2^k x)] (Mildenhall et al. 2020), MLP with relu between its layers, compositing
// (light/composite.cl): with optical depths t_k = density * length and T_k = exp(-sum_{j<k} t_j)
//   radiance = sum_k T_k (1 - exp(-t_k)) c_k + T_K background,
// where segments that begin behind an optical depth of OPAQUE are left out, ray by ray: T there is below 1e-6. A
// work-item ends when all its rays do.
//
// points: camera metres, {1, 3, pixels, samples} or, with per_row, {1, 3, pixels, 1}; direction {1, 3, pixels,
// samples}, camera frame, any length; range {1, 3, 1, 1}: scene_scale first (metres), the unit of the march; radiance
// {1, 3, pixels, samples}, zeroed before. With `listed` only the rays list[0 ... count - 1] are asked, else all of the
// tile. background {1, 3, 1, 1}: what is behind the field. packed: the layers one after the other, as
// light/pack_layer.cl leaves them, from 3 + 6 octaves numbers to 4: red, green, blue, density. For inference: no
// adjoint.
#include "lib/chunk.clh"
#include "light/march.clh"
#include "light/mlp.clh"

#define MOST_WIDTH 64
#define MOST_LAYERS 5

typedef struct {
  int count;
  int width[MOST_LAYERS + 1];  // numbers that go into each layer, and those that leave the last
} FieldLayers;

// width[i], where a processor that has no stack would make one for an index.
static inline int width_of(const FieldLayers *net, int i) {
  const int *w = net->width;
  return i < 2 ? (i == 0 ? w[0] : w[1]) : i < 4 ? (i == 2 ? w[2] : w[3]) : (i == 4 ? w[4] : w[5]);
}

// Rows of `to`: position, which is there, sines of x, y and z in turn, cosines alike; octave k doubles the angle. Every
// third octave is computed from its angle, the two between by sin 2a = 2 sin a cos a and cos 2a = cos^2 a - sin^2 a. These multiply
// errors e of sine and cosine by at most 2 sqrt 2 and add roundings of 0.75 epsilon: from 0.75 epsilon to 2.9 to 8.9 at
// most (4.0 over 2e7 random angles).
static inline void encode_position(SHARED lanes *to, int octaves) {
  GROUP_BARRIER;
  FOR_NUMBERS(c, v, 3) {
    lanes turns = to[VECTORS * c + v] * (R(0.5) * INV_PI), sine, cosine;
    for (int k = 0; k < octaves; ++k, turns *= R(2)) {
      if (k % 3 == 0) {
        wave(turns, &sine, &cosine);
      } else {
        const lanes twice = R(2) * sine * cosine;
        cosine = cosine * cosine - sine * sine;
        sine = twice;
      }
      to[VECTORS * (3 + c * octaves + k) + v] = sine;
      to[VECTORS * (3 + (3 + c) * octaves + k) + v] = cosine;
    }
  }
}

// max(x, 0) + log1p(exp(-|x|)), the logarithm as 2 artanh(t / (2 + t)): its argument is at most 1/3, so what n terms
// leave out is below 9 / 8 * 9^-n / (2 n + 1) of the first: 1.6e-8 and 2e-17.
static inline lanes softplus(const lanes x) {
#ifdef CLERESTORY_DOUBLE
  const int terms = 16;
#else
  const int terms = 7;
#endif
  const lanes t = exp(-fabs(x)), ratio = t / (R(2) + t), square = ratio * ratio;
  lanes sum = (lanes)(R(1) / (real)(2 * terms - 1));
  for (int n = terms - 2; n >= 0; --n) sum = R(1) / (real)(2 * n + 1) + square * sum;
  return fmax(x, (lanes)(R(0))) + R(2) * ratio * sum;
}

kernel void ask_field(IN(points), IN(direction), IN(range), IN_INT(list), IN_INT(count), IN(background), IN(packed),
                      OUT(radiance), CHUNK_ARGS, const int listed, const int per_row, const int segments,
                      const real near, const real radius, const int jittered, const uint seed, const int octaves,
                      const FieldLayers net, const int soft, const int widest, NET_MEMORY) {
  const int first = (int)get_group_id(0) * RAYS, asked = listed ? AT(count, 0)[0] : pixels * sample_capacity;
  local int some_are_open;
  if (first >= asked) return;
  NUMBERS(one, MOST_WIDTH, widest);
  NUMBERS(other, MOST_WIDTH, widest);
  int rays[OWNED * LANES];
  lanes origin[3 * OWNED], along[3 * OWNED], far[OWNED], piece[OWNED];
  FOR_RAYS(l) {
    const int i = min(first + l, asked - 1), ray = listed ? AT(list, 0)[i] : i;
    const ulong plane = per_row ? (ulong)pixel_capacity : RAY_PLANE;
    global const real *from = AT(points, 0) + (per_row ? ray / sample_capacity : ray), *d = AT(direction, 0) + ray;
    const MarchRay r = march_ray((real3)(from[0], from[plane], from[2 * plane]),
                                 (real3)(d[0], d[RAY_PLANE], d[2 * RAY_PLANE]), AT(range, 0)[0], near, radius,
                                 segments);
    rays[OWN(l)] = ray;
    OWN_LANE(origin, l) = r.origin.x, OWN_LANE(origin + OWNED, l) = r.origin.y;
    OWN_LANE(origin + 2 * OWNED, l) = r.origin.z;
    OWN_LANE(along, l) = r.d.x, OWN_LANE(along + OWNED, l) = r.d.y, OWN_LANE(along + 2 * OWNED, l) = r.d.z;
    OWN_LANE(far, l) = r.far, OWN_LANE(piece, l) = r.piece;
  }
  lanes share[4 * OWNED], next[OWNED], depth[OWNED], sum[3 * OWNED];
  for (int v = 0; v < 4 * OWNED; ++v) share[v] = (lanes)(R(0.5));
  for (int v = 0; v < 3 * OWNED; ++v) sum[v] = (lanes)(R(0));
  for (int v = 0; v < OWNED; ++v) depth[v] = next[v] = (lanes)(R(0));
  for (int k = -1; k < segments; ++k) {
    // The points k and k + 1 of each ray; the first round only finds the first point.
    const int ahead = k + 1;
    if (jittered && (ahead & 3) == 0 && ahead < segments)
      FOR_RAYS(l) {
        const int p = rays[OWN(l)] / sample_capacity;
        const real4 u = march_jitter(seed, first_pixel + p, first_sample + rays[OWN(l)] - p * sample_capacity, ahead);
        OWN_LANE(share, l) = u.x, OWN_LANE(share + OWNED, l) = u.y, OWN_LANE(share + 2 * OWNED, l) = u.z;
        OWN_LANE(share + 3 * OWNED, l) = u.w;
      }
    lanes length[OWNED];
    FOR_VECTORS(v) {
      const int own = OWN(v), quarter = ahead & 3;
      const lanes here = next[own];
      const lanes within = quarter < 2 ? (quarter == 0 ? share[own] : share[OWNED + own])
                                       : (quarter == 2 ? share[2 * OWNED + own] : share[3 * OWNED + own]);
      next[own] = ahead < segments ? near + ((real)ahead + within) * piece[own] : fmax(far[own], here);
      length[own] = next[own] - here;
      for (int c = 0; c < 3; ++c) one[VECTORS * c + v] = origin[OWNED * c + own] + here * along[OWNED * c + own];
    }
    if (k < 0) continue;
    encode_position(one, octaves);
    SHARED lanes *from = one, *to = other;
    global const real *weights = AT(packed, 0);
    for (int i = 0; i < net.count; ++i) {
      const int in = width_of(&net, i), out = width_of(&net, i + 1);
      dense(to, from, weights, in, out, 0, i + 1 < net.count || !soft);
      weights += PACKED(in, out);
      SHARED lanes *const written = to;
      to = from, from = written;
    }
    if (soft)
      for (int c = 0; c < 4; ++c) FOR_VECTORS(v) from[VECTORS * c + v] = softplus(from[VECTORS * c + v]);
    int open = 0;
    FOR_VECTORS(v) {
      const int own = OWN(v);
      const lanes thickness = from[3 * VECTORS + v] * length[own], seen = exp(-depth[own]) * -expm1(-thickness);
      const lanes_mask is_open = depth[own] < OPAQUE;
      for (int c = 0; c < 3; ++c) {
        const lanes more = sum[OWNED * c + own] + seen * from[VECTORS * c + v];
        sum[OWNED * c + own] = WHERE(is_open, more, sum[OWNED * c + own]);
      }
      depth[own] = WHERE(is_open, depth[own] + thickness, depth[own]);
      open |= lanes_any(depth[own] < OPAQUE);
    }
    if (!group_any(open, &some_are_open)) break;
  }
  for (int v = 0; v < OWNED; ++v) {
    const lanes through = exp(-depth[v]);
    for (int c = 0; c < 3; ++c) sum[OWNED * c + v] += through * AT(background, 0)[c];
  }
  FOR_RAYS(l) {
    if (first + l >= asked) break;
    global real *y = AT(radiance, 0) + rays[OWN(l)];
    y[0] = OWN_LANE(sum, l), y[RAY_PLANE] = OWN_LANE(sum + OWNED, l), y[2 * RAY_PLANE] = OWN_LANE(sum + 2 * OWNED, l);
  }
}
