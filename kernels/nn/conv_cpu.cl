// Convolution and matrix products on CPU devices: implicit GEMM with a register tile of 8 outputs x 32 positions.
//
//   forward, backward data:  target[n,m,p] = bias[m] + sum_k weights[m,k] * panel[k, p]
//   backward weights:        gradient[m,k] = sum_n,p target[n,m,p] * panel[k, p]
//
// where panel[k, p] is the padded source under tap k at grid position p (nn/conv_geometry.clh). Work-groups hold one
// work-item, whose vectors are explicit real16, so local memory is private scratch and there are no barriers (after Goto
// and van de Geijn, "Anatomy of High-Performance Matrix Multiplication", ACM TOMS 34(3), 2008: the band's panel is their
// packed B, the weights packed by nn/conv_pack.cl their A). All sums run in a fixed order.
// Tensors are NCHW.
#include "nn/conv_geometry.clh"

#define TILE_M 8   // outputs of the register tile; conv_pack.cl packs weights in panels of as many
#define TILE_P 32  // positions of the register tile, two real16

// n elements of a source row starting at pixel x0, zero outside of [0, width), to to[0, n).
static void copy_padded(local real *to, global const real *row, int x0, int width, int n) {
  const int begin = clamp(-x0, 0, n), end = clamp(width - x0, begin, n);
  int i = 0;
  for (; i < begin; ++i) to[i] = R(0);
  global const real *from = row + x0;
  if (end - begin >= 16) {
    for (; i + 16 <= end; i += 16) vstore16(vload16(0, from + i), 0, to + i);
    if (i < end) vstore16(vload16(0, from + end - 16), 0, to + end - 16);
    i = end;
  } else {
    for (; i < end; ++i) to[i] = from[i];
  }
  for (; i < n; ++i) to[i] = R(0);
}

// Every second element of a source row, from x0 on.
static void copy_padded_steps(local real *to, global const real *row, int x0, int step, int width, int n) {
  for (int i = 0; i < n; ++i) {
    const int x = x0 + i * step;
    to[i] = x >= 0 && x < width ? row[x] : R(0);
  }
}

// First grid row (y) and column (x) of a band.
static int2 band_start(int band, const ConvBlocking b) {
  return (int2)(band % b.bands_x * b.band_columns, band / b.bands_x * b.band_rows);
}

// One source channel under the band that starts at grid position `start`, padded, as sub-planes.
static void pack_plane(local real *panel, global const real *source, int2 start, const ConvGeometry g,
                       const ConvBlocking b) {
  const int step = g.source_step, source_h = g.source_plane / g.source_w;
  const int rows = b.band_rows - 1 + (g.taps_y + step - 1) / step;
  for (int py = 0; py < min(step, g.taps_y); ++py)
    for (int px = 0; px < min(step, g.taps_x); ++px) {
      local real *to = panel + (py * step + px) * b.subplane;
      for (int r = 0; r < rows; ++r, to += b.pitch) {
        const int y = (start.y + r) * step + g.source_y + py, x = start.x * step + g.source_x + px;
        const bool inside = y >= 0 && y < source_h;
        global const real *row = source + (inside ? y * g.source_w : 0);
        if (step == 1)
          copy_padded(to, row, x, inside ? g.source_w : 0, b.pitch);
        else
          copy_padded_steps(to, row, x, step, inside ? g.source_w : 0, b.pitch);
      }
      local real *end = panel + (py * step + px + 1) * b.subplane;
      for (; to < end; ++to) *to = R(0);
    }
}

// Where row k of the im2col matrix starts in the panel.
static void tap_offsets(local int *offset, const ConvGeometry g, const ConvBlocking b) {
  const int step = g.source_step;
  int k = 0;
  for (int c = 0; c < b.channel_block; ++c)
    for (int ty = 0; ty < g.taps_y; ++ty)
      for (int tx = 0; tx < g.taps_x; ++tx)
        offset[k++] = c * b.plane + (ty % step * step + tx % step) * b.subplane + ty / step * b.pitch + tx / step;
}

#define FOR_8(F) F(0) F(1) F(2) F(3) F(4) F(5) F(6) F(7)

// sums[8][positions] (+)= weights[k][8]^T * panel[offset[k]][32]
static void multiply_tile(local real *sums, int pitch, global const real *weights, local const real *panel,
                          local const int *offset, int depth, bool first) {
#define ZERO(r) real16 a##r = (real16)(R(0)), b##r = (real16)(R(0));
#define LOAD(r) a##r = vload16(0, sums + r * pitch), b##r = vload16(1, sums + r * pitch);
#define MADD(r) a##r = fma((real16)(w[r]), p0, a##r), b##r = fma((real16)(w[r]), p1, b##r);
#define SAVE(r) vstore16(a##r, 0, sums + r * pitch), vstore16(b##r, 1, sums + r * pitch);
  FOR_8(ZERO)
  if (!first) {
    FOR_8(LOAD)
  }
  for (int k = 0; k < depth; ++k) {
    local const real *p = panel + offset[k];
    global const real *w = weights + k * TILE_M;
    const real16 p0 = vload16(0, p), p1 = vload16(1, p);
    FOR_8(MADD)
  }
  FOR_8(SAVE)
#undef ZERO
#undef LOAD
#undef MADD
#undef SAVE
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

// Group (band, chunk of outputs, batch item). `weights` as conv_pack_weights leaves them; `bias` is read when has_bias.
// Scratch: panel channel_block*plane, sums chunk*positions, offset channel_block*taps_y*taps_x.
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void conv_cpu(
    IN(source), IN(weights), IN(bias), OUT(target), const ConvGeometry g, const int has_bias, const ConvBlocking b,
    local real *panel, local real *sums, local int *offset) {
  const int n = get_group_id(2), m0 = (int)get_group_id(1) * b.chunk;
  const int2 start = band_start(get_group_id(0), b);
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps;
  const int outputs = min(b.chunk, g.outputs - m0);
  tap_offsets(offset, g, b);
  for (int c0 = 0; c0 < g.channels; c0 += b.channel_block) {
    const int channels = min(b.channel_block, g.channels - c0);
    for (int c = 0; c < channels; ++c)
      pack_plane(panel + c * b.plane, AT(source, n) + (ulong)(c0 + c) * g.source_plane, start, g, b);
    for (int m = 0; m < outputs; m += TILE_M) {
      global const real *tile = AT(weights, 0) + (ulong)(m0 + m) * depth + (ulong)c0 * taps * TILE_M;
      for (int f = 0; f < b.positions; f += TILE_P)
        multiply_tile(sums + m * b.positions + f, b.positions, tile, panel + f, offset, channels * taps, c0 == 0);
    }
  }
  const int rows = min(b.band_rows, g.grid_h - start.y), columns = min(b.band_columns, g.grid_w - start.x);
  for (int m = 0; m < outputs; ++m)
    for (int r = 0; r < rows; ++r) {
      const int y = (start.y + r) * g.target_step + g.target_y, x = start.x * g.target_step + g.target_x;
      store_row(AT(target, n) + (ulong)(m0 + m) * g.target_plane + y * g.target_w + x,
                sums + m * b.positions + r * b.pitch, columns, g.target_step, has_bias ? AT(bias, 0)[m0 + m] : R(0));
    }
}

static real sum16(real16 v) {
  const real8 a = v.lo + v.hi;
  const real4 b = a.lo + a.hi;
  const real2 c = b.lo + b.hi;
  return c.x + c.y;
}

// to[8 rows of `pitch`][3] += dot products over positions of target rows [8][positions] and panel rows offset[0..2].
static void dot_tile(global real *to, int pitch, int rows, int columns, local const real *target,
                     local const real *panel, local const int *offset, int positions, bool first) {
#define ZERO(r) real16 x##r = (real16)(R(0)), y##r = (real16)(R(0)), z##r = (real16)(R(0));
#define MADD(r)                                                       \
  {                                                                   \
    const real16 t = vload16(0, target + r * positions + f);          \
    x##r = fma(t, p0, x##r), y##r = fma(t, p1, y##r), z##r = fma(t, p2, z##r); \
  }
#define SAVE(r)                                                                   \
  if (r < rows) {                                                                 \
    global real *row = to + r * pitch;                                            \
    row[0] = sum16(x##r) + (first ? R(0) : row[0]);                               \
    if (columns > 1) row[1] = sum16(y##r) + (first ? R(0) : row[1]);              \
    if (columns > 2) row[2] = sum16(z##r) + (first ? R(0) : row[2]);              \
  }
  local const real *q0 = panel + offset[0], *q1 = panel + offset[columns > 1 ? 1 : 0],
                   *q2 = panel + offset[columns > 2 ? 2 : 0];
  FOR_8(ZERO)
  for (int f = 0; f < positions; f += 16) {
    const real16 p0 = vload16(0, q0 + f), p1 = vload16(0, q1 + f), p2 = vload16(0, q2 + f);
    FOR_8(MADD)
  }
  FOR_8(SAVE)
#undef ZERO
#undef MADD
#undef SAVE
}

// Group (block of source channels, partial). Partial s sums the bands s, s + partials, ... of all batch items into
// gradient[s][outputs][depth]; conv_sum_partials adds them in order.
// Scratch: panel channel_block*plane, rows chunk*positions, offset channel_block*taps_y*taps_x.
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void conv_weights_cpu(
    IN(source), IN(target), OUT(gradient), const ConvGeometry g, const ConvBlocking b, local real *panel, local real *rows, local int *offset) {
  const int c0 = (int)get_group_id(0) * b.channel_block, s = get_group_id(1);
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps;
  const int channels = min(b.channel_block, g.channels - c0), columns = channels * taps;
  global real *gradient = AT(gradient, 0) + (ulong)s * g.outputs * depth;
  tap_offsets(offset, g, b);
  for (int q = s; q < b.bands * b.batch; q += b.partials) {
    const int n = q / b.bands;
    const int2 start = band_start(q % b.bands, b);
    const int band_columns = min(b.band_columns, g.grid_w - start.x);
    for (int c = 0; c < channels; ++c)
      pack_plane(panel + c * b.plane, AT(source, n) + (ulong)(c0 + c) * g.source_plane, start, g, b);
    for (int m0 = 0; m0 < g.outputs; m0 += b.chunk) {
      const int outputs = min(b.chunk, g.outputs - m0);
      for (int m = 0; m < (outputs + TILE_M - 1) / TILE_M * TILE_M; ++m) {
        local real *row = rows + m * b.positions;
        global const real *from = AT(target, n) + (ulong)(m0 + m) * g.target_plane;
        const int grid_rows = m < outputs ? min(b.band_rows, g.grid_h - start.y) : 0;
        int f = 0;
        for (int r = 0; r < grid_rows; ++r, f += b.pitch)
          copy_padded(row + f, from + (start.y + r) * g.target_w + start.x, 0, band_columns, min(b.pitch, b.positions - f));
        for (; f < b.positions; ++f) row[f] = R(0);
      }
      for (int k = 0; k < columns; k += 3)
        for (int m = 0; m < outputs; m += TILE_M)
          dot_tile(gradient + (ulong)(m0 + m) * depth + c0 * taps + k, depth, outputs - m, columns - k,
                   rows + m * b.positions, panel, offset + k, b.positions, q == s);
    }
  }
}
