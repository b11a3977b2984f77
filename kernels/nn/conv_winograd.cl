// 3x3 convolution of stride one on CPU devices by minimal filtering, F(2x2, 3x3) (Winograd, "Arithmetic Complexity of
// Computations", 1980; Lavin and Gray, "Fast Algorithms for Convolutional Neural Networks", CVPR 2016): sixteen
// products a tile of 2x2 positions where a direct sum takes 36.
//
//   target tile = A' [ sum over channels of (G w G') * (B' d B) ] A,   d: the 4x4 source pixels under the tile
//
// Frequency 4 i + j is row i, column j of the 4x4 matrices. A work-group of one work-item takes a band of tiles and a
// chunk of outputs: source channels are transformed a block at a time into local memory, multiplied by the transformed
// weights for each frequency with the register tile of lib/tile.clh, and the sums transformed back. Channels ascend and
// every transform has one order, so that bits depend neither on bands nor on tiles. G has halves and no thirds: whole
// numbers stay exact. Every position of a tile takes part of its roundings, and of its Inf and NaN, from all sixteen
// source pixels under the tile, three pixels away at most. Tensors are NCHW.
//
// Backward weights are the adjoint of that in w: gradient = G' [ sum over tiles (A dy A') * (B' d B) ] G, dy the 2x2
// target pixels of a tile.
#include "nn/conv_panel.clh"

#define FREQUENCIES 16
#define FREQUENCY_PAD 16  // elements between frequencies, so that they do not compete for the same cache sets
#define WEIGHTS_PITCH(g) ((ulong)((g.outputs + PANEL - 1) / PANEL) * PANEL * g.channels + FREQUENCY_PAD)

// How a pass is cut: host/ops/nn/winograd_blocking.hpp. Rows of tiles are those of all batch items, one after the other.
typedef struct {
  int tiles_x, tiles_y;           // of an item
  int band_rows, band_columns;    // tiles of a band
  int bands_x;                    // along a row
  int positions;                  // of a band, a multiple of sixteen
  int channel_block, chunk;       // channels at a time, outputs of one group
  int rows;                       // of all items
  int line;                       // elements of a padded source row
  int partials;                   // backward weights: partial sums over bands
} WinogradBlocking;

// What a group works on: rows of tiles [begin, end) and columns of each, which start at tile x.
typedef struct {
  int begin, end, x, columns;
} Band;

static int bands_in_all(const WinogradBlocking b) { return (b.rows + b.band_rows - 1) / b.band_rows * b.bands_x; }

static Band band_of(int index, const WinogradBlocking b) {
  const int begin = index / b.bands_x * b.band_rows, x = index % b.bands_x * b.band_columns;
  const Band band = {begin, min(begin + b.band_rows, b.rows), x, min(b.band_columns, b.tiles_x - x)};
  return band;
}

#define EVEN(a, b) ((vec)((a).even, (b).even))
#define ODD(a, b) ((vec)((a).odd, (b).odd))

// to[frequency][tile] = B' d B of a row of tiles under four padded source rows.
static void transform_tiles(local real *to, int pitch, local const real *lines, int line, int columns) {
  const int first[4] = {0, 1, 2, 1}, second[4] = {2, 2, 1, 3};
  for (int t = 0; t < columns; t += TILE_WIDTH)
    UNROLL for (int i = 0; i < 4; ++i) {
      local const real *p = lines + first[i] * line + 2 * t, *q = lines + second[i] * line + 2 * t;
      vec d[4];  // at the tile's first pixel, at the third, each with what follows after a vector
      UNROLL for (int k = 0; k < 4; ++k) {
        const int at = k % 2 * TILE_WIDTH + k / 2 * 2;
        const vec a = vec_load(0, p + at), b = vec_load(0, q + at);
        d[k] = i == 1 ? a + b : a - b;
      }
      const vec d0 = EVEN(d[0], d[1]), d1 = ODD(d[0], d[1]), d2 = EVEN(d[2], d[3]), d3 = ODD(d[2], d[3]);
      local real *of = to + 4 * i * pitch + t;
      vec_store(d0 - d2, 0, of);
      vec_store(d1 + d2, 0, of + pitch);
      vec_store(d2 - d1, 0, of + 2 * pitch);
      vec_store(d1 - d3, 0, of + 3 * pitch);
    }
}

// One channel under a band: to[frequency][tile]. `lines` holds the padded source rows of the band.
static void transform_channel(local real *to, int pitch, local real *lines, IN(source), const int channel,
                              const SourceMap map, const Band band, const ConvGeometry g, const WinogradBlocking b) {
  const int source_h = g.source_plane / g.source_w, x = 2 * band.x + g.source_x;
  for (int row = band.begin; row < band.end;) {
    const int n = row / b.tiles_y, y0 = row % b.tiles_y, rows = min(band.end - row, b.tiles_y - y0);
    global const real *plane = AT(source, n) + (ulong)channel * g.source_plane;
    for (int l = 0; l < 2 * rows + 2; ++l) {
      const int y = 2 * y0 + l + g.source_y;
      const bool inside = y >= 0 && y < source_h;
      copy_padded(lines + l * b.line, plane + (inside ? y * g.source_w : 0), x, inside ? g.source_w : 0,
                  2 * band.columns + 2, true, map);
    }
    for (int r = 0; r < rows; ++r, to += band.columns)
      transform_tiles(to, pitch, lines + 2 * r * b.line, b.line, band.columns);
    row += rows;
  }
}

// sums[outputs][positions] (+)= weights[k][PANEL] * panel[k][positions] of `depth` channels, one register tile.
#define WEIGHT(k, r) weights[(k) * PANEL + (r)]
#define PANEL_ROW(k) (panel + (k) * positions)
#define DEFINE_PRODUCT(vectors)                                                                                  \
  static inline void product_##vectors(local real *sums, global const real *weights, local const real *panel,    \
                                       int positions, int depth, bool first) {                                   \
    vec sum[TILE_ROWS][vectors];                                                                                 \
    if (first) {                                                                                                 \
      FOR_TILE(vectors) sum[r][v] = (vec)(R(0));                                                                 \
    } else {                                                                                                     \
      FOR_TILE(vectors) sum[r][v] = vec_load(v, sums + r * positions);                                           \
    }                                                                                                            \
    TILE_PRODUCT(vectors, sum, depth, WEIGHT, PANEL_ROW)                                                         \
    FOR_TILE(vectors) vec_store(sum[r][v], v, sums + r * positions);                                             \
  }
DEFINE_PRODUCT(1)
DEFINE_PRODUCT(2)
DEFINE_PRODUCT(3)

// The same of all outputs and the first `tiles` positions: weights are read once, the panel lies in the first cache.
static void multiply(local real *sums, global const real *weights, int channels, int outputs, local const real *panel,
                     int positions, int tiles, int depth, bool first) {
  for (int m = 0; m < outputs; m += TILE_ROWS, sums += TILE_ROWS * positions) {
    global const real *of = weights + (ulong)(m / PANEL) * PANEL * channels + m % PANEL;
    int at = 0;
    for (int left = (tiles + TILE_WIDTH - 1) / TILE_WIDTH; left > 0;) {
      const int vectors = vectors_of(left);
      if (vectors == 3)
        product_3(sums + at, of, panel + at, positions, depth, first);
      else if (vectors == 2)
        product_2(sums + at, of, panel + at, positions, depth, first);
      else
        product_1(sums + at, of, panel + at, positions, depth, first);
      left -= vectors, at += vectors * TILE_WIDTH;
    }
  }
}

// lines[2][2 columns] = A' m A of a row of tiles, m[frequency][tile].
static void transform_back(local real *lines, int line, local const real *m, int pitch, int columns) {
  for (int t = 0; t < columns; t += TILE_WIDTH) {
    vec upper[4], lower[4];
    UNROLL for (int j = 0; j < 4; ++j) {
      local const real *of = m + j * pitch + t;
      const vec m0 = vec_load(0, of), m1 = vec_load(0, of + 4 * pitch), m2 = vec_load(0, of + 8 * pitch),
                m3 = vec_load(0, of + 12 * pitch);
      upper[j] = m0 + m1 + m2, lower[j] = m1 - m2 - m3;
    }
    UNROLL for (int r = 0; r < 2; ++r) {
      const vec *s = r == 0 ? upper : lower;
      const vec even = s[0] + s[1] + s[2], odd = s[1] - s[2] - s[3];
      vec both;
      both.even = even.lo, both.odd = odd.lo;
      vec_store(both, 0, lines + r * line + 2 * t);
      both.even = even.hi, both.odd = odd.hi;
      vec_store(both, 1, lines + r * line + 2 * t);
    }
  }
}

// Group (band, chunk of outputs); `bias` is read when has_bias. `weights` come from conv_winograd_weights.
// Scratch: panel 16 * (channel_block * positions + pad), sums 16 * (chunk * positions + pad), lines (the band's padded
// rows).
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void conv_winograd(
    IN(source), SOURCE_MAP_PARAMS IN(weights), IN(bias), OUT(target), const ConvGeometry g, const int has_bias,
    const WinogradBlocking b, local real *panel, local real *sums, local real *lines) {
  const Band band = band_of(get_group_id(0), b);
  const int m0 = (int)get_group_id(1) * b.chunk, outputs = min(b.chunk, g.outputs - m0);
  const int panel_pitch = b.channel_block * b.positions + FREQUENCY_PAD;
  const int sums_pitch = b.chunk * b.positions + FREQUENCY_PAD;
  const int tiles = (band.end - band.begin) * band.columns, behind = min(TILE_WIDTH, b.positions - tiles);
  for (int f = 0; f < FREQUENCIES; ++f)
    for (int c = 0; c < b.channel_block; ++c) fill_zeros(panel + f * panel_pitch + c * b.positions + tiles, behind);
  for (int c0 = 0; c0 < g.channels; c0 += b.channel_block) {
    const int channels = min(b.channel_block, g.channels - c0);
    for (int c = 0; c < channels; ++c)
      transform_channel(panel + c * b.positions, panel_pitch, lines, source_base, source_offset, source_stride, c0 + c,
                        SOURCE_MAP(c0 + c), band, g, b);
    for (int f = 0; f < FREQUENCIES; ++f)
      multiply(sums + f * sums_pitch,
               AT(weights, 0) + f * WEIGHTS_PITCH(g) + (ulong)m0 * g.channels + c0 * PANEL, g.channels, outputs,
               panel + f * panel_pitch, b.positions, tiles, channels, c0 == 0);
  }
  for (int m = 0; m < outputs; ++m)
    for (int row = band.begin; row < band.end; ++row) {
      transform_back(lines, b.line, sums + m * b.positions + (row - band.begin) * band.columns, sums_pitch,
                     band.columns);
      const int y = row % b.tiles_y * 2, x = 2 * band.x, n = min(2 * band.columns, g.grid_w - x);
      global real *to = AT(target, row / b.tiles_y) + (ulong)(m0 + m) * g.target_plane + y * g.target_w + x;
      const real shift = has_bias ? AT(bias, 0)[m0 + m] : R(0);
      store_row(to, lines, n, 1, shift);
      if (y + 1 < g.grid_h) store_row(to + g.target_w, lines + b.line, n, 1, shift);
    }
}

// Row i of G w: of three rows of w.
static inline real8 filter_row(int i, real8 w0, real8 w1, real8 w2) {
  return i == 0 ? w0 : i == 1 ? R(0.5) * (w0 + w2 + w1) : i == 2 ? R(0.5) * (w0 + w2 - w1) : w2;
}

// weights[frequency][panel][channel][8] = G w G' of output 8*panel + r, zero past the last output; arguments as those of
// nn/conv_pack.cl's conv_pack_weights. Work-item (channel, panel).
kernel void conv_winograd_weights(IN(w), OUT(weights), const ConvGeometry g, const int output_pitch,
                                  const int channel_pitch, const int kernel_w, const int2 first, const int2 step) {
  const int c = get_global_id(0), panel = get_global_id(1);
  const int outputs = min(g.outputs - PANEL * panel, PANEL);
  if (c >= g.channels || outputs <= 0) return;
  global const real *tap = AT(w, 0) + (ulong)(PANEL * panel) * output_pitch + (ulong)c * channel_pitch +
                           first.y * kernel_w + first.x;
  real8 of[3][3];
  UNROLL for (int ty = 0; ty < 3; ++ty)
    UNROLL for (int tx = 0; tx < 3; ++tx) {
      global const real *from = tap + ty * step.y * kernel_w + tx * step.x;
      real each[PANEL];
      UNROLL for (int r = 0; r < PANEL; ++r) each[r] = r < outputs ? from[(ulong)r * output_pitch] : R(0);
      of[ty][tx] = vload8(0, each);
    }
  const ulong pitch = WEIGHTS_PITCH(g);
  global real *to = AT(weights, 0) + ((ulong)panel * g.channels + c) * PANEL;
  UNROLL for (int i = 0; i < 4; ++i) {
    const real8 row0 = filter_row(i, of[0][0], of[1][0], of[2][0]), row1 = filter_row(i, of[0][1], of[1][1], of[2][1]),
                row2 = filter_row(i, of[0][2], of[1][2], of[2][2]);
    UNROLL for (int j = 0; j < 4; ++j) vstore8(filter_row(j, row0, row1, row2), 0, to + (4 * i + j) * pitch);
  }
}

// to[2][columns][width] = two target rows from `from` on, `present` outputs of `n` pixels, zero where there is nothing.
static void transpose_rows(local real *to, int columns, int width, global const real *from, int rows, int n, int present,
                           const ConvGeometry g) {
  if (rows < 2 || n < columns || present < width) fill_zeros(to, 2 * columns * width);
  for (int r = 0; r < rows; ++r)
    transpose(to + r * columns * width, width, from + r * g.target_w, g.target_plane, present, n);
}

// to[frequency][tile][width] = A m A' of a row of tiles, m their pixels in lines[2][2 columns][width].
static void transform_target(local real *to, int pitch, local const real *lines, int columns, int width) {
  for (int t = 0; t < columns; ++t)
    for (int v = 0; v < width; v += TILE_WIDTH) {
      local const real *upper = lines + 2 * t * width + v, *lower = upper + 2 * columns * width;
      const vec m00 = vec_load(0, upper), m01 = vec_load(0, upper + width), m10 = vec_load(0, lower),
                m11 = vec_load(0, lower + width);
      const vec left[4] = {m00, m00 + m10, m00 - m10, -m10}, right[4] = {m01, m01 + m11, m01 - m11, -m11};
      local real *of = to + t * width + v;
      UNROLL for (int i = 0; i < 4; ++i, of += 4 * pitch) {
        vec_store(left[i], 0, of);
        vec_store(left[i] + right[i], 0, of + pitch);
        vec_store(left[i] - right[i], 0, of + 2 * pitch);
        vec_store(-right[i], 0, of + 3 * pitch);
      }
    }
}

// sums[channels][vectors] (+)= over `tiles` the panel's rows, `positions` apart, times target[tile][vectors]. The rows of
// sums are rounded up to tiles of registers.
#define CHANNEL(k, r) of[r][k]
#define TARGET_ROW(k) (target + (k) * width)
#define DEFINE_OUTER(vectors)                                                                                      \
  static inline void outer_##vectors(local real *sums, int pitch, local const real *panel, int positions,          \
                                     int channels, local const real *target, int tiles, bool first) {              \
    const int width = vectors * TILE_WIDTH;                                                                        \
    for (int c = 0; c < channels; c += TILE_ROWS, sums += TILE_ROWS * pitch) {                                     \
      local const real *of[TILE_ROWS];                                                                             \
      UNROLL for (int r = 0; r < TILE_ROWS; ++r) of[r] = panel + min(c + r, channels - 1) * positions;             \
      vec sum[TILE_ROWS][vectors];                                                                                 \
      if (first) {                                                                                                 \
        FOR_TILE(vectors) sum[r][v] = (vec)(R(0));                                                                 \
      } else {                                                                                                     \
        FOR_TILE(vectors) sum[r][v] = vec_load(v, sums + r * pitch);                                               \
      }                                                                                                            \
      TILE_PRODUCT(vectors, sum, tiles, CHANNEL, TARGET_ROW)                                                       \
      FOR_TILE(vectors) vec_store(sum[r][v], v, sums + r * pitch);                                                 \
    }                                                                                                              \
  }
DEFINE_OUTER(1)
DEFINE_OUTER(2)
DEFINE_OUTER(3)

// to[tap][width] of one channel and its first n outputs = G' u G, u[frequency][width].
static void transform_gradient(local real *to, int width, int n, local const real *u, int pitch) {
  for (int v = 0; v < n; v += TILE_WIDTH) {
    vec of[3][4];
    UNROLL for (int j = 0; j < 4; ++j) {
      local const real *from = u + j * pitch + v;
      const vec u0 = vec_load(0, from), u1 = vec_load(0, from + 4 * pitch), u2 = vec_load(0, from + 8 * pitch),
                u3 = vec_load(0, from + 12 * pitch);
      const vec half_sum = R(0.5) * (u1 + u2);
      of[0][j] = u0 + half_sum, of[1][j] = R(0.5) * (u1 - u2), of[2][j] = half_sum + u3;
    }
    UNROLL for (int i = 0; i < 3; ++i) {
      const vec half_sum = R(0.5) * (of[i][1] + of[i][2]);
      local real *at = to + 3 * i * width + v;
      vec_store(of[i][0] + half_sum, 0, at);
      vec_store(R(0.5) * (of[i][1] - of[i][2]), 0, at + width);
      vec_store(half_sum + of[i][3], 0, at + 2 * width);
    }
  }
}

// The target of a band's tiles: rows[frequency][vectors of outputs][tile], `pitch` between frequencies.
static void transform_outputs(local real *rows, int pitch, local real *lines, IN(target), int m0, int outputs,
                              const Band band, const ConvGeometry g, const WinogradBlocking b) {
  const int columns = 2 * band.columns, x = 2 * band.x;
  for (int m = 0, left = (outputs + TILE_WIDTH - 1) / TILE_WIDTH; left > 0;) {
    const int count = vectors_of(left), width = count * TILE_WIDTH;
    for (int row = band.begin; row < band.end; ++row) {
      const int y = row % b.tiles_y * 2;
      transpose_rows(lines, columns, width,
                     AT(target, row / b.tiles_y) + (ulong)(m0 + m) * g.target_plane + y * g.target_w + x,
                     min(2, g.grid_h - y), min(columns, g.grid_w - x), min(width, outputs - m), g);
      transform_target(rows + m * b.positions + (row - band.begin) * band.columns * width, pitch, lines, band.columns,
                       width);
    }
    left -= count, m += width;
  }
}

// Group (block of source channels, partial, chunk of outputs): gradient[partial][outputs][channels][3][3], of the
// partial's stretch of bands. conv_sum_partials adds the partials in order.
// Scratch: panel 16 * (channel_block * positions + pad), rows 16 * (chunk * positions + pad), sums
// 16 * (chunk * (channel_block rounded up to 8) + pad), lines (the band's padded source rows, or two target rows of 48
// outputs).
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void conv_winograd_gradient(
    IN(source), SOURCE_MAP_PARAMS IN(target), OUT(gradient), const ConvGeometry g, const WinogradBlocking b,
    local real *panel, local real *rows, local real *sums, local real *lines) {
  const int c0 = (int)get_group_id(0) * b.channel_block, m0 = (int)get_group_id(2) * b.chunk;
  const int channels = min(b.channel_block, g.channels - c0), outputs = min(b.chunk, g.outputs - m0);
  const int panel_pitch = b.channel_block * b.positions + FREQUENCY_PAD;
  const int rows_pitch = b.chunk * b.positions + FREQUENCY_PAD;
  const int sums_pitch = b.chunk * ((b.channel_block + PANEL - 1) / PANEL) * PANEL + FREQUENCY_PAD;
  const int2 own = bands_of_partial(get_group_id(1), b.partials, bands_in_all(b));
  for (int at = own.x; at < own.y; ++at) {
    const Band band = band_of(at, b);
    const int tiles = (band.end - band.begin) * band.columns;
    for (int c = 0; c < channels; ++c)
      transform_channel(panel + c * b.positions, panel_pitch, lines, source_base, source_offset, source_stride, c0 + c,
                        SOURCE_MAP(c0 + c), band, g, b);
    transform_outputs(rows, rows_pitch, lines, target_base, target_offset, target_stride, m0, outputs, band, g, b);
    for (int f = 0; f < FREQUENCIES; ++f)
      for (int m = 0, left = (outputs + TILE_WIDTH - 1) / TILE_WIDTH; left > 0;) {
        const int count = vectors_of(left);
        local real *to = sums + f * sums_pitch + m;
        local const real *of = panel + f * panel_pitch, *by = rows + f * rows_pitch + m * b.positions;
        if (count == 3)
          outer_3(to, b.chunk, of, b.positions, channels, by, tiles, at == own.x);
        else if (count == 2)
          outer_2(to, b.chunk, of, b.positions, channels, by, tiles, at == own.x);
        else
          outer_1(to, b.chunk, of, b.positions, channels, by, tiles, at == own.x);
        left -= count, m += count * TILE_WIDTH;
      }
  }
  // As many channels at a time as find room where the target was, and eight rows of the gradient.
  const int depth = 9 * g.channels, most = FREQUENCIES * b.positions / 9;
  for (int c = 0; c < channels; c += most) {
    const int some = min(most, channels - c);
    for (int k = 0; k < some; ++k)
      transform_gradient(rows + 9 * k * b.chunk, b.chunk, outputs, sums + (c + k) * b.chunk, sums_pitch);
    global real *to = AT(gradient, 0) + ((ulong)get_group_id(1) * g.outputs + m0) * depth + 9 * (c0 + c);
    for (int m = 0; m < outputs; m += 8)
      transpose(to + (ulong)m * depth, depth, rows + m, b.chunk, 9 * some, min(8, outputs - m));
  }
}
