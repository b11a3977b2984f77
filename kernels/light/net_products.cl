// Small nets along rays where a BLAS multiplies (host/ops/light/net_layers.hpp), in place of the one kernel of
// light/ask_mlp.cl or light/ask_field.cl: what stands between the products. A block of `columns` rays, or of points of
// rays, is worked on at a time: ray i of the block is list[first + i] if `listed`, else first + i. Matrices {numbers,
// columns} lie in `work`, each at the element that its argument says.
#include "lib/chunk.clh"
#include "lib/frame.clh"
#include "lib/turn.clh"
#include "light/march.clh"

#define RAY_OF_BLOCK(i) (listed ? AT(list, 0)[first + (i)] : first + (i))

// A NaN stays one.
static inline real rectified(real x) { return x < R(0) ? R(0) : x; }
static inline real softplus(real x) { return fmax(x, R(0)) + log1p(exp(-fabs(x))); }
// (cosine, sine) of any number of turns.
static inline real2 wave_of(real turns) { return turn(turns - floor(turns)); }

// to[m] = bias[m] for m < outputs, which a product is then added to; and relu of the layer before, from[k] for
// k < inputs. Work-item (column, row).
kernel void begin_layer(IN(bias), OUT(work), const int columns, const int to, const int outputs, const int from,
                        const int inputs) {
  const int i = (int)get_global_id(0), row = (int)get_global_id(1);
  if (i >= columns) return;
  global real *at = AT(work, 0) + (ulong)row * (ulong)columns + (ulong)i;
  if (row < outputs) at[to] = AT(bias, 0)[row];
  if (row < inputs) at[from] = rectified(at[from]);
}

// along[j], along[waves + j]: sine and cosine of 2 pi B_j d. Work-item (ray, wave).
kernel void encode_directions(IN(direction), IN(frequencies), IN_INT(list), OUT(work), const int listed,
                              const int first, const int columns, const int along, const int waves,
                              const ulong ray_plane) {
  const int i = (int)get_global_id(0), j = (int)get_global_id(1);
  if (i >= columns) return;
  global const real *d = AT(direction, 0) + RAY_OF_BLOCK(i), *b = AT(frequencies, j);
  const real2 wave = wave_of(fma(b[2], d[2 * ray_plane], fma(b[1], d[ray_plane], b[0] * d[0])));
  AT(work, 0)[along + j * columns + i] = wave.y;
  AT(work, 0)[along + (waves + j) * columns + i] = wave.x;
}

// to[c] += rows[pixel that the ray hits][skip + c]; what a miss gets means nothing. Work-item (ray, number).
kernel void add_rows(IN(rows), IN_INT(hit), IN_INT(list), OUT(work), const int listed, const int first,
                     const int columns, const int to, const int stride, const int skip, const int samples,
                     const int sample_capacity) {
  const int i = (int)get_global_id(0), c = (int)get_global_id(1);
  if (i >= columns) return;
  const int pixel = max(HIT_OF(RAY_OF_BLOCK(i)), 0);
  AT(work, 0)[to + c * columns + i] += AT(rows, 0)[(ulong)pixel * (ulong)stride + (ulong)(skip + c)];
}

// The last layer's three numbers to the rays that hit something.
kernel void put_answers(IN(work), IN_INT(hit), IN_INT(list), OUT(f), const int listed, const int first,
                        const int columns, const int from, const int samples, const int sample_capacity,
                        const ulong ray_plane) {
  const int i = (int)get_global_id(0), c = (int)get_global_id(1);
  if (i >= columns) return;
  const int ray = RAY_OF_BLOCK(i);
  if (HIT_OF(ray) >= 0) AT(f, 0)[c * ray_plane + (ulong)ray] = AT(work, 0)[from + c * columns + i];
}

// Where in its piece point k of a ray lies.
static inline real share_of(int jittered, uint seed, int pixel, int sample, int k) {
  if (!jittered) return R(0.5);
  const real4 u = march_jitter(seed, pixel, sample, k & ~3);
  return (k & 3) == 0 ? u.x : (k & 3) == 1 ? u.y : (k & 3) == 2 ? u.z : u.w;
}

// Column k * rays + r is point k of ray r: its position and the sines and cosines of it, as ask_field encodes them, and
// at `lengths` how far the next point is. Work-item (ray, point).
kernel void encode_points(IN(points), IN(direction), IN(range), IN_INT(list), OUT(work), CHUNK_ARGS, const int listed,
                          const int first, const int rays, const int encoded, const int lengths, const int per_row,
                          const int segments, const real near, const real radius, const int jittered, const uint seed,
                          const int octaves) {
  const int r = (int)get_global_id(0), k = (int)get_global_id(1), columns = rays * segments;
  if (r >= rays) return;
  const int ray = RAY_OF_BLOCK(r), p = ray / sample_capacity, s = ray - p * sample_capacity;
  const ulong plane = per_row ? (ulong)pixel_capacity : RAY_PLANE;
  global const real *from = AT(points, 0) + (per_row ? p : ray), *d = AT(direction, 0) + ray;
  const MarchRay m = march_ray((real3)(from[0], from[plane], from[2 * plane]),
                               (real3)(d[0], d[RAY_PLANE], d[2 * RAY_PLANE]), AT(range, 0)[0], near, radius, segments);
  const int pixel = first_pixel + p, sample = first_sample + s;
  const real here = near + ((real)k + share_of(jittered, seed, pixel, sample, k)) * m.piece;
  real next = fmax(m.far, here);
  if (k + 1 < segments) next = near + ((real)(k + 1) + share_of(jittered, seed, pixel, sample, k + 1)) * m.piece;
  global real *to = AT(work, 0) + k * rays + r;
  to[lengths] = next - here;
  const real3 at = m.origin + here * m.d;
  const real x[3] = {at.x, at.y, at.z};
  for (int c = 0; c < 3; ++c) {
    to[encoded + c * columns] = x[c];
    real turns = x[c] * (R(0.5) * INV_PI);
    for (int o = 0; o < octaves; ++o, turns *= R(2)) {
      const real2 wave = wave_of(turns);
      to[encoded + (3 + c * octaves + o) * columns] = wave.y;
      to[encoded + (3 + (3 + c) * octaves + o) * columns] = wave.x;
    }
  }
}

// The rays' radiance from the last layer's red, green, blue and density, as ask_field puts it together. Work-item: ray.
kernel void composite_points(IN(work), IN(background), IN_INT(list), OUT(radiance), const int listed, const int first,
                             const int rays, const int from, const int lengths, const int segments, const int soft,
                             const ulong ray_plane) {
  const int r = (int)get_global_id(0), columns = rays * segments;
  if (r >= rays) return;
  real depth = R(0), sum[3] = {R(0), R(0), R(0)};
  for (int k = 0; k < segments; ++k) {
    global const real *at = AT(work, 0) + k * rays + r;
    real v[4];
    for (int c = 0; c < 4; ++c) {
      const real number = at[from + c * columns];
      v[c] = soft ? softplus(number) : rectified(number);
    }
    const real thickness = v[3] * at[lengths], seen = exp(-depth) * -expm1(-thickness);
    if (depth >= OPAQUE) break;
    for (int c = 0; c < 3; ++c) sum[c] += seen * v[c];
    depth += thickness;
  }
  global real *y = AT(radiance, 0) + RAY_OF_BLOCK(r);
  for (int c = 0; c < 3; ++c) y[c * ray_plane] = sum[c] + exp(-depth) * AT(background, 0)[c];
}
