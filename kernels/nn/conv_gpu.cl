// Convolution and matrix products on GPU devices: implicit GEMM in tiles of 64 rows x 128 columns, both operands staged in
// local memory.
//
//   forward, backward data:  target[n,m,p] = bias[m] + sum_k weights[m,k] * source under tap k at position p
//   backward weights:        gradient[m,k] = sum_n,p target[n,m,p] * source under tap k at position p
//
// Geometry as in nn/conv_geometry.clh, weights as conv_pack.cl leaves them: the host contract of nn/conv_cpu.cl.
// A work-group of 16 x 8 computes a tile, a work-item 8 x 8 of it in registers: of rows and of columns twice four that lie
// side by side, half a tile apart, so that each step reads four vectors and multiplies 64 times. While a block of DEPTH steps
// is multiplied, the next one's numbers are on their way. Sums run in a fixed order. NCHW.
#define MAPS_ONE_BY_ONE  // no vectors of numbers are normalised at once
#include "nn/conv_geometry.clh"

#define ROWS 64
#define COLUMNS 128
#define DEPTH 16
// Of local rows: multiples of a vector that keep neighbours of a column in different banks.
#define LEFT_PITCH (ROWS + 4)
#define RIGHT_PITCH (COLUMNS + 4)
#define UNROLL _Pragma("unroll")
#define ROW_OF(i) ((i) / 4 * (ROWS / 2) + 4 * (int)get_local_id(1) + (i) % 4)
#define COLUMN_OF(j) ((j) / 4 * (COLUMNS / 2) + 4 * (int)get_local_id(0) + (j) % 4)

// sums[8][2] += left[DEPTH][ROWS]^T * right[DEPTH][COLUMNS], the item's rows and columns of it.
static inline void multiply_tiles(real4 *sums, local const real4 *left, local const real4 *right) {
  left += get_local_id(1), right += get_local_id(0);
  for (int k = 0; k < DEPTH; ++k, left += LEFT_PITCH / 4, right += RIGHT_PITCH / 4) {
    const real4 upper = left[0], lower = left[ROWS / 8], near = right[0], far = right[COLUMNS / 8];
    const real a[8] = {upper.x, upper.y, upper.z, upper.w, lower.x, lower.y, lower.z, lower.w};
    UNROLL for (int i = 0; i < 8; ++i) {
      sums[2 * i] = fma((real4)(a[i]), near, sums[2 * i]);
      sums[2 * i + 1] = fma((real4)(a[i]), far, sums[2 * i + 1]);
    }
  }
}

// Four numbers from q on, or those that are before `end`.
static inline void store4(const real4 v, global real *to, const int q, const int end) {
  if (q + 4 <= end) {
    vstore4(v, 0, to + q);
    return;
  }
  if (q < end) to[q] = v.x;
  if (q + 1 < end) to[q + 1] = v.y;
  if (q + 2 < end) to[q + 2] = v.z;
}

// Where a tap of the inner index lies, stepped without a division. Uniform over the group.
typedef struct {
  int channel, y, x;
} Tap;

static inline void next_tap(Tap *tap, const ConvGeometry g) {
  if (++tap->x < g.taps_x) return;
  tap->x = 0;
  if (++tap->y < g.taps_y) return;
  tap->y = 0;
  ++tap->channel;
}

// Group (128 positions, 64 outputs, batch item). Each item fetches one position of every step, and eight weights.
kernel __attribute__((reqd_work_group_size(16, 8, 1))) void conv_gpu(
    IN(source), SOURCE_MAP_PARAMS IN(weights), IN(bias), OUT(target), const ConvGeometry g, const int has_bias) {
  local real4 left[DEPTH * LEFT_PITCH / 4], right[DEPTH * RIGHT_PITCH / 4];
  local SourceMap maps[DEPTH];  // of the steps that are fetched next
  const int item = get_local_id(1) * 16 + get_local_id(0), n = get_group_id(2);
  const int p0 = get_group_id(0) * COLUMNS, m0 = get_group_id(1) * ROWS;
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps, positions = g.grid_h * g.grid_w;
  const int p = p0 + item, source_h = g.source_plane / g.source_w;
  // A position past the last one lies beside the picture.
  const int y0 = p < positions ? p / g.grid_w * g.source_step + g.source_y : source_h;
  const int x0 = p % g.grid_w * g.source_step + g.source_x;
  const int panel = m0 / 8 + item / DEPTH, step = item % DEPTH;
  global const real *weight = AT(weights, 0) + ((ulong)panel * depth + step) * 8;
  const int has_weights = panel < (g.outputs + 7) / 8;
  global const real *from = AT(source, n);
  Tap tap = {0, 0, 0};
  real fetched[DEPTH];
  real8 fetched_weights;
#define PUT_MAPS(k0) \
  if (item < DEPTH) maps[item] = SOURCE_MAP(min((k0) + item, depth - 1) / taps);
#define FETCH(k0)                                                                                          \
  {                                                                                                        \
    fetched_weights = has_weights && (k0) + step < depth ? vload8(k0, weight) : (real8)(R(0));             \
    UNROLL for (int d = 0; d < DEPTH; ++d) {                                                               \
      const int y = y0 + tap.y, x = x0 + tap.x;                                                            \
      const int inside = (k0) + d < depth && (uint)y < (uint)source_h && (uint)x < (uint)g.source_w;       \
      const int at = tap.channel * g.source_plane + y * g.source_w + x;                                    \
      fetched[d] = inside ? map1(maps[d], from[at]) : R(0);                                                \
      next_tap(&tap, g);                                                                                   \
    }                                                                                                      \
  }
  real4 sums[16];
  UNROLL for (int i = 0; i < 16; ++i) sums[i] = (real4)(R(0));
  PUT_MAPS(0)
  barrier(CLK_LOCAL_MEM_FENCE);
  FETCH(0)
  for (int k0 = 0; k0 < depth; k0 += DEPTH) {
    barrier(CLK_LOCAL_MEM_FENCE);
    left[(step * LEFT_PITCH + item / DEPTH * 8) / 4] = fetched_weights.lo;
    left[(step * LEFT_PITCH + item / DEPTH * 8) / 4 + 1] = fetched_weights.hi;
    UNROLL for (int d = 0; d < DEPTH; ++d) ((local real *)right)[d * RIGHT_PITCH + item] = fetched[d];
    PUT_MAPS(k0 + DEPTH)
    barrier(CLK_LOCAL_MEM_FENCE);
    FETCH(k0 + DEPTH)
    multiply_tiles(sums, left, right);
  }
#undef FETCH
#undef PUT_MAPS
  // Where targets of a row lie side by side they are stored so.
  const int in_order = g.target_step == 1 && g.target_y == 0 && g.target_x == 0 && g.grid_w == g.target_w;
  UNROLL for (int i = 0; i < 8; ++i) {
    const int m = m0 + ROW_OF(i);
    if (m >= g.outputs) continue;
    const real add = has_bias ? AT(bias, 0)[m] : R(0);
    global real *to = AT(target, n) + (ulong)m * g.target_plane;
    UNROLL for (int half_of = 0; half_of < 2; ++half_of) {
      const int q = p0 + COLUMN_OF(4 * half_of);
      const real4 v = sums[2 * i + half_of] + add;
      if (in_order) {
        store4(v, to, q, positions);
        continue;
      }
      const real four[4] = {v.x, v.y, v.z, v.w};
      UNROLL for (int j = 0; j < 4; ++j)
        if (q + j < positions)
          to[((q + j) / g.grid_w * g.target_step + g.target_y) * g.target_w + (q + j) % g.grid_w * g.target_step +
             g.target_x] = four[j];
    }
  }
}

// Group (128 of depth, 64 outputs, partial). Partial s sums stretches s, s + partials, ... of DEPTH positions over all batch
// items into gradient[s][outputs][depth]. Sixteen items fetch the positions of a stretch, of every eighth row and column.
kernel __attribute__((reqd_work_group_size(16, 8, 1))) void conv_weights_gpu(
    IN(source), SOURCE_MAP_PARAMS IN(target), OUT(gradient), const ConvGeometry g, const int batch, const int partials) {
  local real4 left[DEPTH * LEFT_PITCH / 4], right[DEPTH * RIGHT_PITCH / 4];
  local int2 taps_at[COLUMNS];  // of each column: offset in a source item, and the tap's y and x
  local SourceMap maps[COLUMNS];
  const int item = get_local_id(1) * 16 + get_local_id(0), s = get_group_id(2);
  const int k0 = get_group_id(0) * COLUMNS, m0 = get_group_id(1) * ROWS;
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps, positions = g.grid_h * g.grid_w;
  const int stretches = (positions + DEPTH - 1) / DEPTH, source_h = g.source_plane / g.source_w;
  {
    const int k = min(k0 + item, depth - 1), y = k % taps / g.taps_x, x = k % g.taps_x;
    taps_at[item] = (int2)(k / taps * g.source_plane + y * g.source_w + x, y << 16 | x);
    maps[item] = SOURCE_MAP(k / taps);
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  const int d = item % DEPTH, first = item / DEPTH;
  real fetched_rows[ROWS / 8], fetched[COLUMNS / 8];
#define FETCH(q)                                                                                              \
  {                                                                                                           \
    const int n = (q) / stretches, p = (q) % stretches * DEPTH + d, gy = p / g.grid_w, gx = p % g.grid_w;     \
    const int y0 = p < positions ? gy * g.source_step + g.source_y : source_h;                                \
    const int x0 = gx * g.source_step + g.source_x, at = gy * g.target_w + gx, corner = y0 * g.source_w + x0; \
    global const real *row = AT(target, n), *from = AT(source, n);                                            \
    UNROLL for (int j = 0; j < ROWS / 8; ++j) {                                                               \
      const int m = m0 + first + 8 * j;                                                                       \
      fetched_rows[j] = p < positions && m < g.outputs ? row[m * g.target_plane + at] : R(0);          \
    }                                                                                                         \
    UNROLL for (int j = 0; j < COLUMNS / 8; ++j) {                                                            \
      const int2 tap = taps_at[first + 8 * j];                                                                \
      const int y = y0 + (tap.y >> 16), x = x0 + (tap.y & 0xffff);                                            \
      const int inside = (uint)y < (uint)source_h && (uint)x < (uint)g.source_w && k0 + first + 8 * j < depth; \
      fetched[j] = inside ? map1(maps[first + 8 * j], from[corner + tap.x]) : R(0);                           \
    }                                                                                                         \
  }
  real4 sums[16];
  UNROLL for (int i = 0; i < 16; ++i) sums[i] = (real4)(R(0));
  const int end = stretches * batch;
  if (s < end) FETCH(s)
  for (int q = s; q < end; q += partials) {
    barrier(CLK_LOCAL_MEM_FENCE);
    UNROLL for (int j = 0; j < ROWS / 8; ++j) ((local real *)left)[d * LEFT_PITCH + first + 8 * j] = fetched_rows[j];
    UNROLL for (int j = 0; j < COLUMNS / 8; ++j) ((local real *)right)[d * RIGHT_PITCH + first + 8 * j] = fetched[j];
    barrier(CLK_LOCAL_MEM_FENCE);
    if (q + partials < end) FETCH(q + partials)
    multiply_tiles(sums, left, right);
  }
#undef FETCH
  UNROLL for (int i = 0; i < 8; ++i) {
    const int m = m0 + ROW_OF(i);
    if (m >= g.outputs) continue;
    global real *to = AT(gradient, 0) + ((ulong)s * g.outputs + m) * depth;
    store4(sums[2 * i], to, k0 + COLUMN_OF(0), depth);
    store4(sums[2 * i + 1], to, k0 + COLUMN_OF(4), depth);
  }
}
