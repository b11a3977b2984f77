// Convolution and matrix products on CPU devices: implicit GEMM by the register tile of lib/tile.clh.
//
//   forward, backward data:  target[n,m,p] = bias[m] + sum_k weights[m,k] * panel[k, p]
//   backward weights:        gradient[m,k] = sum_n,p target[n,m,p] * panel[k, p]
//
// where panel[k, p] is the padded source under tap k at grid position p (nn/conv_geometry.clh). Backward weights are
// sums of outer products over positions, whose vectors run over outputs; where outputs are too few to fill vectors,
// they are dot products, whose vectors run over positions. Work-groups hold one work-item, whose vectors are explicit
// real16, so local memory is private scratch and there are no barriers (after Goto and van de Geijn, "Anatomy of
// High-Performance Matrix Multiplication", ACM TOMS 34(3), 2008: the band's panel is their packed B, the weights packed
// by nn/conv_pack.cl their A). All sums run in a fixed order. Tensors are NCHW.
#include "nn/conv_panel.clh"

#define LINE (64 / (int)sizeof(real))  // elements of a cache line

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

// What will be copied next: `pieces` of `length` elements, `pitch` apart, asked for `lines` cache lines at a time while
// what was copied before is multiplied. A hint: nothing depends on it.
typedef struct {
  global const real *at;
  int pieces, length, done, lines;
  ulong pitch;
} Ahead;

static inline Ahead ahead_of(global const real *at, int pieces, int length, ulong pitch) {
  const Ahead a = {at, length > 0 ? pieces : 0, length, 0, 1, pitch};
  return a;
}

// So many lines with each of `tiles` that none is left.
static inline void spread(Ahead *a, int tiles) { a->lines = (a->pieces * (a->length / LINE + 1) + tiles - 1) / tiles; }

static inline void ask(Ahead *a) {
  for (int lines = a->lines; lines > 0 && a->pieces > 0; --lines) {
    ASK_FOR(a->at + a->done);
    a->done += LINE;
    if (a->done >= a->length) a->done = 0, a->at += a->pitch, --a->pieces;
  }
}

// Weights of outputs m to m + TILE_ROWS under inner index k. Packed they are panels of [k][8], as conv_pack_weights leaves
// them. With -D WEIGHTS_AS_STORED they are rows of [output][k], whose last stands in for those behind it.
#ifdef WEIGHTS_AS_STORED
typedef struct {
  global const real *row[TILE_ROWS];
} TileWeights;
#define TILE_WEIGHT(k, r) weights.row[r][k]
#define WEIGHTS_AT(weights, m, k, depth) ((weights) + (ulong)(m) * (depth) + (k))
static inline TileWeights tile_weights(global const real *weights, int pitch, int m, int outputs) {
  TileWeights of;
  UNROLL for (int r = 0; r < TILE_ROWS; ++r) of.row[r] = weights + (ulong)min(m + r, outputs - 1) * pitch;
  return of;
}
#else
typedef struct {
  global const real *from;
} TileWeights;
#define TILE_WEIGHT(k, r) weights.from[(k) * PANEL + (r)]
#define WEIGHTS_AT(weights, m, k, depth) ((weights) + (ulong)(m) * (depth) + (k) * PANEL)
static inline TileWeights tile_weights(global const real *weights, int pitch, int m, int outputs) {
  const TileWeights of = {weights + (ulong)(m / PANEL) * PANEL * pitch + m % PANEL};
  return of;
}
#endif

// Weights times `vectors` vectors of the band's panel: sums[outputs][positions] (+)= weights * panel[offset[k]], where
// weights of outputs are `weights_pitch` apart. With every tile some lines of what is ahead are asked for. One
// function for each number of vectors, so that positions need rounding up to one vector only.
#define PANEL_ROW(k) (panel + offset[k])
#define DEFINE_MULTIPLY(vectors)                                                                                    \
  static void multiply_##vectors(local real *sums, int pitch, global const real *all, int weights_pitch,            \
                                 int outputs, local const real *panel, local const int *offset, int depth,          \
                                 bool first, Ahead *ahead) {                                                        \
    for (int m = 0; m < outputs; m += TILE_ROWS, sums += TILE_ROWS * pitch) {                                       \
      ask(ahead);                                                                                                   \
      const TileWeights weights = tile_weights(all, weights_pitch, m, outputs);                                     \
      vec sum[TILE_ROWS][vectors];                                                                                  \
      if (first) {                                                                                                  \
        FOR_TILE(vectors) sum[r][v] = (vec)(R(0));                                                                  \
      } else {                                                                                                      \
        FOR_TILE(vectors) sum[r][v] = vec_load(v, sums + r * pitch);                                                \
      }                                                                                                             \
      TILE_PRODUCT(vectors, sum, depth, TILE_WEIGHT, PANEL_ROW)                                                     \
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
  spread(ahead, (left + TILE_VECTORS - 1) / TILE_VECTORS * ((outputs + TILE_ROWS - 1) / TILE_ROWS));
  while (left > 0) {
    const int vectors = vectors_of(left);
    if (vectors == 3)
      multiply_3(sums, pitch, weights, weights_pitch, outputs, panel, offset, depth, first, ahead);
    else if (vectors == 2)
      multiply_2(sums, pitch, weights, weights_pitch, outputs, panel, offset, depth, first, ahead);
    else
      multiply_1(sums, pitch, weights, weights_pitch, outputs, panel, offset, depth, first, ahead);
    left -= vectors, sums += vectors * TILE_WIDTH, panel += vectors * TILE_WIDTH;
  }
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

// Group (band, chunk of outputs, batch item). `weights` of outputs lie weights_pitch apart; `bias` is read when has_bias.
// Scratch: panel channel_block*plane, sums chunk*positions, offset channel_block*taps_y*taps_x.
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void conv_cpu(
    IN(source), SOURCE_MAP_PARAMS IN(weights), const int weights_pitch, IN(bias), OUT(target), const ConvGeometry g,
    const int has_bias, const ConvBlocking b, local real *panel, local real *sums, local int *offset) {
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
    multiply_band(sums, b.positions, WEIGHTS_AT(AT(weights, 0), m0, c0 * taps, weights_pitch), weights_pitch, outputs,
                  panel, offset, channels * taps, positions, c0 == 0, &ahead);
  }
  for (int m = 0; m < outputs; ++m)
    for (int r = 0; r < rows; ++r) {
      const int y = (start.y + r) * g.target_step + g.target_y, x = start.x * g.target_step + g.target_x;
      store_row(AT(target, n) + (ulong)(m0 + m) * g.target_plane + y * g.target_w + x,
                sums + m * b.positions + r * b.pitch, columns, g.target_step, has_bias ? AT(bias, 0)[m0 + m] : R(0));
    }
}

// Positions of a stack: bands panel_pitch apart in the panel, their rows pitch apart.
typedef struct {
  int bands, rows, columns;
  int panel_pitch, pitch;
} Positions;

// sums[depth][vectors] (+)= over all positions, in order, the panel's rows offset[0..depth) times the target, which
// lies as [position][vectors]. The rows of sums are rounded up to tiles.
#define DEFINE_OUTER(vectors)                                                                                        \
  static void outer_##vectors(local real *sums, int pitch, local const real *target, local const real *panel,        \
                              local const int *offset, int depth, const Positions p, bool first,                     \
                              Ahead *next_target, Ahead *next_source) {                                              \
    for (int k = 0; k < depth; k += TILE_ROWS, sums += TILE_ROWS * pitch) {                                          \
      ask(next_target), ask(next_source);                                                                            \
      local const real *row[TILE_ROWS], *from = target;                                                              \
      vec sum[TILE_ROWS][vectors];                                                                                   \
      UNROLL for (int r = 0; r < TILE_ROWS; ++r) row[r] = panel + offset[min(k + r, depth - 1)];                     \
      FOR_TILE(vectors) sum[r][v] = (vec)(R(0));                                                                     \
      for (int q = 0; q < p.bands; ++q)                                                                              \
        for (int y = 0; y < p.rows; ++y) {                                                                           \
          const int begin = q * p.panel_pitch + y * p.pitch;                                                         \
          for (int f = begin; f < begin + p.columns; ++f, from += vectors * TILE_WIDTH) {                            \
            vec t[vectors];                                                                                          \
            UNROLL for (int v = 0; v < vectors; ++v) t[v] = vec_load(v, from);                                       \
            FOR_TILE(vectors) sum[r][v] = fma((vec)(row[r][f]), t[v], sum[r][v]);                                    \
          }                                                                                                          \
        }                                                                                                            \
      if (!first) {                                                                                                  \
        FOR_TILE(vectors) sum[r][v] += vec_load(v, sums + r * pitch);                                                \
      }                                                                                                              \
      FOR_TILE(vectors) vec_store(sum[r][v], v, sums + r * pitch);                                                   \
    }                                                                                                                \
  }
DEFINE_OUTER(1)
DEFINE_OUTER(2)
DEFINE_OUTER(3)

// Group (block of source channels, partial, chunk of outputs). A partial sums its bands, `stack` of them at a time,
// into gradient[partial][outputs][depth]; conv_sum_partials adds the partials in order. Only bands that are whole items
// are stacked.
// Scratch: panel stack*channel_block*plane; rows stack*band_rows*band_columns*48, the target under the widest tile;
// sums chunk*(channel_block*taps_y*taps_x rounded up to 8); offset channel_block*taps_y*taps_x.
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void conv_weights_outer(
    IN(source), SOURCE_MAP_PARAMS IN(target), OUT(gradient), const ConvGeometry g, const ConvBlocking b,
    local real *panel, local real *rows, local real *sums, local int *offset) {
  const int c0 = (int)get_group_id(0) * b.channel_block, m0 = (int)get_group_id(2) * b.chunk;
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps, source_h = g.source_plane / g.source_w;
  const int channels = min(b.channel_block, g.channels - c0), columns = channels * taps;
  const int outputs = min(b.chunk, g.outputs - m0), vectors = (outputs + TILE_WIDTH - 1) / TILE_WIDTH;
  const int tiles = (columns + TILE_ROWS - 1) / TILE_ROWS;
  const int2 own = bands_of_partial(get_group_id(1), b.partials, (long)b.bands * b.batch);
  tap_offsets(offset, g, b);
  for (int at = own.x; at < own.y; at += b.stack) {
    const int next = min(at + b.stack, own.y);
    const int2 start = band_start(at % b.bands, b), next_start = band_start(next % b.bands, b);
    const Positions p = {next - at, min(b.band_rows, g.grid_h - start.y), min(b.band_columns, g.grid_w - start.x),
                         b.channel_block * b.plane, b.pitch};
    for (int i = 0; i < p.bands; ++i)
      for (int c = 0; c < channels; ++c)
        pack_plane(panel + i * p.panel_pitch + c * b.plane,
                   AT(source, (at + i) / b.bands) + (ulong)(c0 + c) * g.source_plane, source_h, SOURCE_MAP(c0 + c),
                   start, g, b);
    Ahead next_source =
        panel_ahead(AT(source, next / b.bands), c0, next < own.y ? c0 + channels : c0, next_start, g, b);
    spread(&next_source, tiles * ((vectors + TILE_VECTORS - 1) / TILE_VECTORS));
    // Whole rows of the target are one row of many positions.
    const int pieces = p.columns == g.target_w ? 1 : p.rows, piece = p.rows * p.columns / pieces;
    for (int m = 0, left = vectors; left > 0;) {
      const int count = vectors_of(left), width = count * TILE_WIDTH, present = min(width, outputs - m);
      local real *to = rows;
      if (present < width) fill_zeros(rows, p.bands * p.rows * p.columns * width);
      for (int i = 0; i < p.bands; ++i)
        for (int y = 0; y < pieces; ++y, to += piece * width)
          transpose(to, width,
                    AT(target, (at + i) / b.bands) + (ulong)(m0 + m) * g.target_plane + (start.y + y) * g.target_w +
                        start.x,
                    g.target_plane, present, piece);
      left -= count;
      const int after = left > 0 ? m + width : 0, item = (left > 0 ? at : next) / b.bands;
      const int2 from = left > 0 ? start : next_start;
      Ahead next_target = ahead_of(
          AT(target, item) + (ulong)(m0 + after) * g.target_plane + from.y * g.target_w + from.x,
          left > 0 || next < own.y ? min(TILE_VECTORS * TILE_WIDTH, outputs - after) : 0, piece, g.target_plane);
      spread(&next_target, tiles);
      if (count == 3)
        outer_3(sums + m, b.chunk, rows, panel, offset, columns, p, at == own.x, &next_target, &next_source);
      else if (count == 2)
        outer_2(sums + m, b.chunk, rows, panel, offset, columns, p, at == own.x, &next_target, &next_source);
      else
        outer_1(sums + m, b.chunk, rows, panel, offset, columns, p, at == own.x, &next_target, &next_source);
      m += width;
    }
  }
  // Eight rows of the gradient at a time, so that whole cache lines of them are written.
  global real *to = AT(gradient, 0) + ((ulong)get_group_id(1) * g.outputs + m0) * depth + c0 * taps;
  for (int m = 0; m < outputs; m += 8)
    transpose(to + (ulong)m * depth, depth, sums + m, b.chunk, columns, min(8, outputs - m));
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

// lanes[3][8][16] (+)= products of target rows [8][positions], of which there are `rows`, and panel rows offset[0..2],
// of which there are `columns`: each of 16 lanes sums every 16th position, in one order for every tile. A tile takes
// TILE_ROWS of the rows and TILE_WIDTH of the lanes at a time.
static void dot_tile(local real *lanes, local const real *target, int positions, local const real *panel,
                     local const int *offset, int rows, int columns, bool first) {
  const int offset0 = offset[0], offset1 = offset[columns > 1 ? 1 : 0], offset2 = offset[columns > 2 ? 2 : 0];
  for (int lane = 0; lane < 16; lane += TILE_WIDTH)
    for (int m = 0; m < rows; m += TILE_ROWS) {
      local real *to = lanes + m * 16 + lane;
      local const real *from = target + m * positions + lane, *band = panel + lane;
      vec sum[TILE_ROWS][3];
      if (first) {
        FOR_TILE(3) sum[r][v] = (vec)(R(0));
      } else {
        FOR_TILE(3) sum[r][v] = vec_load(0, to + (v * PANEL + r) * 16);
      }
      for (int f = 0; f < positions; f += 16) {
        const vec row[3] = {vec_load(0, band + offset0 + f), vec_load(0, band + offset1 + f),
                            vec_load(0, band + offset2 + f)};
        UNROLL for (int r = 0; r < TILE_ROWS; ++r) {
          const vec t = vec_load(0, from + r * positions + f);
          UNROLL for (int v = 0; v < 3; ++v) sum[r][v] = fma(t, row[v], sum[r][v]);
        }
      }
      FOR_TILE(3) vec_store(sum[r][v], 0, to + (v * PANEL + r) * 16);
    }
}

// to[8 rows of `pitch`][3] = the sums of lanes[3][8][16].
static void add_lanes(global real *to, int pitch, int rows, int columns, local const real *lanes) {
  real sum[3][PANEL];
  UNROLL for (int v = 0; v < 3; ++v) {
    real16 of[PANEL];
    UNROLL for (int r = 0; r < PANEL; ++r) of[r] = vload16(v * PANEL + r, lanes);
    vstore8(sums_of(of), 0, sum[v]);
  }
  for (int r = 0; r < rows; ++r, to += pitch)
    for (int v = 0; v < min(columns, 3); ++v) to[v] = sum[v][r];
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

// Group (block of source channels, partial), of at most PANEL outputs: the same gradient by dot products.
// Scratch: panel channel_block*plane; rows PANEL*positions, the target; lanes 3*8*16 for every three of
// channel_block*taps_y*taps_x; offset as many of these.
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void conv_weights_dot(
    IN(source), SOURCE_MAP_PARAMS IN(target), OUT(gradient), const ConvGeometry g, const ConvBlocking b,
    local real *panel, local real *rows, local real *lanes, local int *offset) {
  const int c0 = (int)get_group_id(0) * b.channel_block;
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps, source_h = g.source_plane / g.source_w;
  const int channels = min(b.channel_block, g.channels - c0), columns = channels * taps;
  const int2 own = bands_of_partial(get_group_id(1), b.partials, (long)b.bands * b.batch);
  tap_offsets(offset, g, b);
  for (int at = own.x; at < own.y; ++at) {
    const int n = at / b.bands;
    const int2 start = band_start(at % b.bands, b);
    for (int c = 0; c < channels; ++c)
      pack_plane(panel + c * b.plane, AT(source, n) + (ulong)(c0 + c) * g.source_plane, source_h, SOURCE_MAP(c0 + c),
                 start, g, b);
    for (int m = 0; m < PANEL; ++m)
      pack_target(rows + m * b.positions, AT(target, n) + (ulong)m * g.target_plane, m < g.outputs, start, g, b);
    for (int k = 0; k < columns; k += 3)
      dot_tile(lanes + k * PANEL * 16, rows, b.positions, panel, offset + k, g.outputs, columns - k, at == own.x);
  }
  global real *to = AT(gradient, 0) + (ulong)get_group_id(1) * g.outputs * depth + c0 * taps;
  for (int k = 0; k < columns; k += 3) add_lanes(to + k, depth, g.outputs, columns - k, lanes + k * PANEL * 16);
}
