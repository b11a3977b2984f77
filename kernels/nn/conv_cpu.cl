// Convolution and matrix products on CPU devices: implicit GEMM by the register tile of lib/tile.clh.
//
//   forward, backward data:  target[n,m,p] = bias[m] + sum_k weights[m,k] * panel[k, p]
//   backward weights:        gradient[m,k] = sum_n,p target[n,m,p] * panel[k, p]
//
// where panel[k, p] is the padded source under tap k at grid position p (nn/conv_geometry.clh). Work-groups hold one
// work-item, whose vectors are explicit real16, so local memory is private scratch and there are no barriers (after Goto
// and van de Geijn, "Anatomy of High-Performance Matrix Multiplication", ACM TOMS 34(3), 2008: the band's panel is their
// packed B, the weights packed by nn/conv_pack.cl their A). All sums run in a fixed order.
// Tensors are NCHW.
#include "lib/tile.clh"
#include "nn/conv_geometry.clh"

#define LINE (64 / (int)sizeof(real))  // elements of a cache line

// Zero is read anew by each call: a compiler that knew it would keep a vector of zeros in a register through the product,
// whose tile takes all sixteen of AVX2.
static void fill_zeros(local real *to, int n) {
  const volatile real nothing = R(0);
  const real zero = nothing;
  int i = 0;
  for (; i + 16 <= n; i += 16) vstore16((real16)(zero), 0, to + i);
  for (; i < n; ++i) to[i] = zero;
}

// n elements of a row starting at pixel x0, zero outside of [0, width), to to[0, n). With `mapped` source elements go
// through the map.
static inline void copy_padded(local real *to, global const real *row, int x0, int width, int n, bool mapped,
                               const SourceMap map) {
  const int begin = clamp(-x0, 0, n), end = clamp(width - x0, begin, n);
  fill_zeros(to, begin);
  global const real *from = row + x0;
  int i = begin;
  if (end - begin >= 16) {
    for (; i < end; i += 16) {
      const int at = min(i, end - 16);
      const real16 v = vload16(0, from + at);
      vstore16(mapped ? map16(map, v) : v, 0, to + at);
    }
  } else if (end - begin >= 8) {
    for (; i < end; i += 8) {
      const int at = min(i, end - 8);
      const real8 v = vload8(0, from + at);
      vstore8(mapped ? map8(map, v) : v, 0, to + at);
    }
  } else {
    for (; i < end; ++i) to[i] = mapped ? map1(map, from[i]) : from[i];
  }
  fill_zeros(to + end, n - end);
}

// The same of elements `step` apart, from x0 on.
static void copy_padded_steps(local real *to, global const real *row, int x0, int step, int width, int n,
                              const SourceMap map) {
  for (int i = 0; i < n; ++i) {
    const int x = x0 + i * step;
    to[i] = x >= 0 && x < width ? map1(map, row[x]) : R(0);
  }
}

// First grid row (y) and column (x) of a band.
static int2 band_start(int band, const ConvBlocking b) {
  return (int2)(band % b.bands_x * b.band_columns, band / b.bands_x * b.band_rows);
}

// One source channel under the band that starts at grid position `start`, padded, as sub-planes.
static void pack_plane(local real *panel, global const real *source, int source_h, const SourceMap map, int2 start,
                       const ConvGeometry g, const ConvBlocking b) {
  const int step = g.source_step;
  const int rows = b.band_rows - 1 + (g.taps_y + step - 1) / step;
  for (int py = 0; py < min(step, g.taps_y); ++py)
    for (int px = 0; px < min(step, g.taps_x); ++px) {
      local real *to = panel + (py * step + px) * b.subplane;
      for (int r = 0; r < rows; ++r, to += b.pitch) {
        const int y = (start.y + r) * step + g.source_y + py, x = start.x * step + g.source_x + px;
        const bool inside = y >= 0 && y < source_h;
        global const real *row = source + (inside ? y * g.source_w : 0);
        if (step == 1)
          copy_padded(to, row, x, inside ? g.source_w : 0, b.pitch, true, map);
        else
          copy_padded_steps(to, row, x, step, inside ? g.source_w : 0, b.pitch, map);
      }
      fill_zeros(to, b.subplane - rows * b.pitch);
    }
}

// Where row k of the im2col matrix starts in the panel.
static void tap_offsets(local int *offset, const ConvGeometry g, const ConvBlocking b) {
  const int step = g.source_step;
  const int taps = g.taps_y * g.taps_x;
  int k = 0;
  for (int ty = 0; ty < g.taps_y; ++ty)
    for (int tx = 0; tx < g.taps_x; ++tx)
      offset[k++] = (ty % step * step + tx % step) * b.subplane + ty / step * b.pitch + tx / step;
  for (; k < b.channel_block * taps; ++k) offset[k] = offset[k - taps] + b.plane;
}

// What will be copied next: `pieces` of `length` elements, `pitch` apart, asked for a few cache lines at a time while
// what was copied before is multiplied. A hint: nothing depends on it.
typedef struct {
  global const real *at;
  int pieces, length, done;
  ulong pitch;
} Ahead;

static inline Ahead ahead_of(global const real *at, int pieces, int length, ulong pitch) {
  const Ahead a = {at, length > 0 ? pieces : 0, length, 0, pitch};
  return a;
}

static inline void ask(Ahead *a, int lines) {
  for (; lines > 0 && a->pieces > 0; --lines) {
    ASK_FOR(a->at + a->done);
    a->done += LINE;
    if (a->done >= a->length) a->done = 0, a->at += a->pitch, --a->pieces;
  }
}

// Cache lines to ask for with each of `tiles`, so that none is left.
static inline int lines_each(const Ahead *a, int tiles) {
  return (a->pieces * (a->length / LINE + 1) + tiles - 1) / tiles;
}

// Weights times `vectors` vectors of the band's panel: sums[outputs][positions] (+)= weights * panel[offset[k]], where
// weights are panels of [k][8], weights_pitch apart. With every tile some `lines` of what is ahead are asked for. One
// function for each number of vectors, so that positions need rounding up to one vector only.
#define PANEL_ROW(k) (panel + offset[k])
#define DEFINE_MULTIPLY(vectors)                                                                                    \
  static void multiply_##vectors(local real *sums, int pitch, global const real *weights, int weights_pitch,        \
                                 int outputs, local const real *panel, local const int *offset, int depth,          \
                                 bool first, Ahead *ahead, int lines) {                                             \
    for (int m = 0; m < outputs; m += TILE_ROWS, sums += TILE_ROWS * pitch) {                                       \
      ask(ahead, lines);                                                                                            \
      global const real *from = weights + (ulong)(m / PANEL) * weights_pitch + m % PANEL;                           \
      vec sum[TILE_ROWS][vectors];                                                                                  \
      if (first) {                                                                                                  \
        FOR_TILE(vectors) sum[r][v] = (vec)(R(0));                                                                  \
      } else {                                                                                                      \
        FOR_TILE(vectors) sum[r][v] = vec_load(v, sums + r * pitch);                                                \
      }                                                                                                             \
      TILE_PRODUCT(vectors, sum, from, depth, PANEL_ROW)                                                            \
      FOR_TILE(vectors) vec_store(sum[r][v], v, sums + r * pitch);                                                  \
    }                                                                                                               \
  }
DEFINE_MULTIPLY(1)
DEFINE_MULTIPLY(2)
DEFINE_MULTIPLY(3)

// The same for all positions, tile by tile: what of the panel is under a tile stays in the first cache while the weights
// of all outputs stream past it.
static void multiply_band(local real *sums, int pitch, global const real *weights, int weights_pitch, int outputs,
                          local const real *panel, local const int *offset, int depth, int positions, bool first,
                          Ahead *ahead) {
  int left = (positions + TILE_WIDTH - 1) / TILE_WIDTH;
  const int tiles = (left + TILE_VECTORS - 1) / TILE_VECTORS * ((outputs + TILE_ROWS - 1) / TILE_ROWS);
  const int lines = lines_each(ahead, tiles);
  while (left > 0) {
    const int vectors = left == 4 ? 2 : min(left, TILE_VECTORS);  // two twos are faster than three and one
    if (vectors == 3)
      multiply_3(sums, pitch, weights, weights_pitch, outputs, panel, offset, depth, first, ahead, lines);
    else if (vectors == 2)
      multiply_2(sums, pitch, weights, weights_pitch, outputs, panel, offset, depth, first, ahead, lines);
    else
      multiply_1(sums, pitch, weights, weights_pitch, outputs, panel, offset, depth, first, ahead, lines);
    left -= vectors, sums += vectors * TILE_WIDTH, panel += vectors * TILE_WIDTH;
  }
}

// Target row of n pixels, `step` apart.
static void store_row(global real *to, local const real *from, int n, int step, real bias) {
  int i = 0;
  if (step == 1 && n >= 16) {
    for (; i < n; i += 16) {
      const int at = min(i, n - 16);
      vstore16(vload16(0, from + at) + bias, 0, to + at);
    }
    return;
  }
  for (; i < n; ++i) to[i * step] = from[i] + bias;
}

// Source channels c0 to c1 under the band that starts at `start`: its rows, or of a band of columns its part of the
// first.
static Ahead panel_ahead(global const real *source, int c0, int c1, int2 start, const ConvGeometry g,
                         const ConvBlocking b) {
  const int h = g.source_plane / g.source_w, top = start.y * g.source_step + g.source_y;
  const int y0 = clamp(top, 0, h), y1 = clamp(top + (b.band_rows - 1) * g.source_step + g.taps_y, y0, h);
  const int x0 = b.bands_x > 1 ? start.x * g.source_step : 0;
  const int length = b.bands_x > 1 ? min(b.band_columns * g.source_step, g.source_w - x0) : (y1 - y0) * g.source_w;
  return ahead_of(source + (ulong)c0 * g.source_plane + y0 * g.source_w + x0, c1 - c0, length, g.source_plane);
}

// Group (band, chunk of outputs, batch item). `weights` as conv_pack_weights leaves them; `bias` is read when has_bias.
// Scratch: panel channel_block*plane, sums chunk*positions, offset channel_block*taps_y*taps_x.
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void conv_cpu(
    IN(source), SOURCE_MAP_PARAMS IN(weights), IN(bias), OUT(target), const ConvGeometry g, const int has_bias,
    const ConvBlocking b, local real *panel, local real *sums, local int *offset) {
  const int n = get_group_id(2), m0 = (int)get_group_id(1) * b.chunk;
  const int2 start = band_start(get_group_id(0), b);
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps, source_h = g.source_plane / g.source_w;
  const int outputs = min(b.chunk, g.outputs - m0);
  const int rows = min(b.band_rows, g.grid_h - start.y), columns = min(b.band_columns, g.grid_w - start.x);
  const int positions = (rows - 1) * b.pitch + columns;
  tap_offsets(offset, g, b);
  for (int c0 = 0; c0 < g.channels; c0 += b.channel_block) {
    const int channels = min(b.channel_block, g.channels - c0);
    for (int c = 0; c < channels; ++c)
      pack_plane(panel + c * b.plane, AT(source, n) + (ulong)(c0 + c) * g.source_plane, source_h,
                 SOURCE_MAP(c0 + c), start, g, b);
    const int next = c0 + channels;
    Ahead ahead = next < g.channels
                      ? panel_ahead(AT(source, n), next, min(next + b.channel_block, g.channels), start, g, b)
                      : panel_ahead(AT(source, n), 0, min(b.channel_block, g.channels),
                                    band_start(get_group_id(0) + 1, b), g, b);
    multiply_band(sums, b.positions, AT(weights, 0) + (ulong)m0 * depth + (ulong)c0 * taps * PANEL, depth * PANEL, outputs,
                  panel, offset, channels * taps, positions, c0 == 0, &ahead);
  }
  for (int m = 0; m < outputs; ++m)
    for (int r = 0; r < rows; ++r) {
      const int y = (start.y + r) * g.target_step + g.target_y, x = start.x * g.target_step + g.target_x;
      store_row(AT(target, n) + (ulong)(m0 + m) * g.target_plane + y * g.target_w + x,
                sums + m * b.positions + r * b.pitch, columns, g.target_step, has_bias ? AT(bias, 0)[m0 + m] : R(0));
    }
}

// The sums of the elements of eight vectors: halves, quarters, pairs and elements are added while vectors are put
// together, so that every addition has sixteen useful lanes until the last.
static real8 sums_of(const real16 *v) {
#define HALVES(a, b) ((real16)(a.lo, b.lo) + (real16)(a.hi, b.hi))
#define QUARTERS(a, b) ((real16)(a.s012389ab, b.s012389ab) + (real16)(a.s4567cdef, b.s4567cdef))
#define PAIRS(a, b) ((real16)(a.s014589cd, b.s014589cd) + (real16)(a.s2367abef, b.s2367abef))
  const real16 h0 = HALVES(v[0], v[1]), h1 = HALVES(v[2], v[3]), h2 = HALVES(v[4], v[5]), h3 = HALVES(v[6], v[7]);
  const real16 q0 = QUARTERS(h0, h1), q1 = QUARTERS(h2, h3);
  const real16 p = PAIRS(q0, q1);
  return p.even + p.odd;
#undef HALVES
#undef QUARTERS
#undef PAIRS
}

// lanes[3][8][16] (+)= products of target rows [8][pitch], of which there are `rows`, and panel rows offset[0..2], of which
// there are `columns`, over positions [begin, end) of `count` bands that lie target_pitch and panel_pitch apart: each of 16 lanes sums every 16th position, in one order for
// every tile. A tile takes TILE_ROWS of the rows and TILE_WIDTH of the lanes at a time.
static void dot_tile(local real *lanes, local const real *target, int pitch, int target_pitch, local const real *panel,
                     int panel_pitch, local const int *offset, int rows, int columns, int begin, int end, int count,
                     bool first) {
  const int offset0 = offset[0], offset1 = offset[columns > 1 ? 1 : 0], offset2 = offset[columns > 2 ? 2 : 0];
  for (int lane = 0; lane < 16; lane += TILE_WIDTH)
    for (int m = 0; m < min(rows, PANEL); m += TILE_ROWS) {
      local real *to = lanes + m * 16 + lane;
      vec sum[TILE_ROWS][3];
      if (first) {
        FOR_TILE(3) sum[r][v] = (vec)(R(0));
      } else {
        FOR_TILE(3) sum[r][v] = vec_load(0, to + (v * PANEL + r) * 16);
      }
      for (int q = 0; q < count; ++q) {
        local const real *from = target + q * target_pitch + m * pitch + lane, *band = panel + q * panel_pitch + lane;
        for (int f = begin; f < end; f += 16) {
          const vec row[3] = {vec_load(0, band + offset0 + f), vec_load(0, band + offset1 + f),
                              vec_load(0, band + offset2 + f)};
          UNROLL for (int r = 0; r < TILE_ROWS; ++r) {
            const vec t = vec_load(0, from + r * pitch + f);
            UNROLL for (int v = 0; v < 3; ++v) sum[r][v] = fma(t, row[v], sum[r][v]);
          }
        }
      }
      FOR_TILE(3) vec_store(sum[r][v], 0, to + (v * PANEL + r) * 16);
    }
}

// to[8 rows of `pitch`][3] (+)= the sums of lanes[3][8][16].
static void add_lanes(global real *to, int pitch, int rows, int columns, local const real *lanes, bool first) {
  real sum[3][PANEL];
  UNROLL for (int v = 0; v < 3; ++v) {
    real16 of[PANEL];
    UNROLL for (int r = 0; r < PANEL; ++r) of[r] = vload16(v * PANEL + r, lanes);
    vstore8(sums_of(of), 0, sum[v]);
  }
  for (int r = 0; r < min(rows, PANEL); ++r, to += pitch)
    for (int v = 0; v < min(columns, 3); ++v) to[v] = sum[v][r] + (first ? R(0) : to[v]);
}

// Of `total` things the share of each of the fewest groups of at most `most`, or of one each.
static inline int even_share(const int total, const int most) {
  const int groups = (total + max(1, most) - 1) / max(1, most);
  return (total + groups - 1) / groups;
}

// to[outputs][columns] (+)= dot products of target and panel rows over all positions of `count` bands, stretch by stretch:
// so many positions of so many bands that eight rows of the target stay in the first cache. The lanes of all tiles wait
// for the next stretch in memory, if there is one.
static void dot_band(global real *to, int pitch, int outputs, int columns, local const real *target, int target_pitch,
                     local const real *panel, int panel_pitch, local const int *offset, local real *lanes,
                     const ConvBlocking b, int count, bool first) {
  const int part = 16 * even_share(b.positions / 16, b.stretch / 16), bands = even_share(count, b.stretch / b.positions);
  const bool whole = part >= b.positions && bands >= count;
  for (int m = 0; m < outputs; m += PANEL, to += PANEL * pitch, target += PANEL * b.positions)
    for (int q = 0; q < count; q += bands)
      for (int f = 0; f < b.positions; f += part)
        for (int k = 0; k < columns; k += 3) {
          local real *own = lanes + (whole ? 0 : k * PANEL * 16);
          dot_tile(own, target + q * target_pitch, b.positions, target_pitch, panel + q * panel_pitch, panel_pitch,
                   offset + k, outputs - m, columns - k, f, min(f + part, b.positions), min(bands, count - q), q == 0 && f == 0);
          if (q + bands >= count && f + part >= b.positions)
            add_lanes(to + k, pitch, outputs - m, columns - k, own, first);
        }
}

// One target channel under the band that starts at grid position `start`, on the panel's positions: zero between rows and
// where there is no such channel.
static void pack_target(local real *to, global const real *target, bool exists, int2 start, const ConvGeometry g,
                        const ConvBlocking b) {
  const int rows = exists ? min(b.band_rows, g.grid_h - start.y) : 0, columns = min(b.band_columns, g.grid_w - start.x);
  int f = 0;
  for (int r = 0; r < rows; ++r, f += b.pitch)
    copy_padded(to + f, target + (start.y + r) * g.target_w + start.x, 0, columns, min(b.pitch, b.positions - f),
                false, SOURCE_MAP_NONE);
  fill_zeros(to + f, b.positions - f);
}

// Row `row` of n elements of an item among those of a stack that lie end to end in to[0, size): zeros follow the last.
static void pack_item(local real *to, global const real *row, int n, int item, bool last, int size, bool mapped,
                      const SourceMap map) {
  copy_padded(to + item * n, row, 0, n, n, mapped, map);
  if (last) fill_zeros(to + (item + 1) * n, size - (item + 1) * n);
}

// Group (block of source channels, partial, share of outputs). Partial s sums the bands s, s + partials, ... of all batch
// items into gradient[s][outputs][depth], `stack` of them at a time; conv_sum_partials adds the partials in order. Where
// b.item is not 0 the bands are whole items of one row, and those of a stack lie end to end as one.
// Scratch: panel strips*channel_block*plane, rows strips*chunk*positions, where strips is 1 or, without b.item, the stack;
// lanes 3*8*16 or, where a stretch is not all, as many for every three columns; offset channel_block*taps_y*taps_x.
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void conv_weights_cpu(IN(source), SOURCE_MAP_PARAMS
                                                                            IN(target), OUT(gradient),
                                                                            const ConvGeometry g, const ConvBlocking b,
                                                                            local real *panel, local real *rows,
                                                                            local real *lanes, local int *offset) {
  const int c0 = (int)get_group_id(0) * b.channel_block, s = get_group_id(1);
  const int begin = (int)get_group_id(2) * b.share, end = min(begin + b.share, g.outputs);
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps, source_h = g.source_plane / g.source_w;
  const int channels = min(b.channel_block, g.channels - c0), columns = channels * taps;
  const int panel_pitch = b.channel_block * b.plane, rows_pitch = b.chunk * b.positions;
  global real *to = AT(gradient, 0) + (ulong)s * g.outputs * depth + c0 * taps;
  tap_offsets(offset, g, b);
  for (int first = s; first < b.bands * b.batch; first += b.partials * b.stack) {
    const int count = min(b.stack, (b.bands * b.batch - first + b.partials - 1) / b.partials);
    for (int i = 0; i < count; ++i) {
      const int band = (first + i * b.partials) % b.bands, n = (first + i * b.partials) / b.bands;
      for (int c = 0; c < channels; ++c) {
        global const real *from = AT(source, n) + (ulong)(c0 + c) * g.source_plane;
        if (b.item > 0)
          pack_item(panel + c * b.plane, from, b.item, i, i + 1 == count, b.plane, true, SOURCE_MAP(c0 + c));
        else
          pack_plane(panel + i * panel_pitch + c * b.plane, from, source_h, SOURCE_MAP(c0 + c), band_start(band, b), g, b);
      }
    }
    for (int m0 = begin; m0 < end; m0 += b.chunk) {
      const int outputs = min(b.chunk, end - m0);
      for (int i = 0; i < count; ++i) {
        const int band = (first + i * b.partials) % b.bands, n = (first + i * b.partials) / b.bands;
        for (int m = 0; m < (outputs + PANEL - 1) / PANEL * PANEL; ++m) {
          global const real *from = AT(target, n) + (ulong)(m0 + m) * g.target_plane;
          local real *row = rows + m * b.positions;
          if (b.item == 0)
            pack_target(row + i * rows_pitch, from, m < outputs, band_start(band, b), g, b);
          else if (m < outputs)
            pack_item(row, from, b.item, i, i + 1 == count, b.positions, false, SOURCE_MAP_NONE);
          else if (i == 0)
            fill_zeros(row, b.positions);
        }
      }
      dot_band(to + (ulong)m0 * depth, depth, outputs, columns, rows, rows_pitch, panel, panel_pitch, offset, lanes, b,
               b.item > 0 ? 1 : count, first == s);
    }
  }
}
