// Convolution of each channel with a kernel of its own, K x K, of -D STRIDE 1 or 2 (the depthwise convolution of
// MobileNets [Howard et al. 2017, arXiv 1704.04861]):
//   y[n,c,j,i] = bias[c] + sum over ky, kx of w[c,ky,kx] x[n,c, STRIDE j + ky - pad_y, STRIDE i + kx - pad_x],
// zeros around the picture. x {N,C,H,W}, w {C,1,K,K}, bias {1,C,1,1}. A work-group takes one tile of one plane: what the
// tile reads lies in local memory as STRIDE x STRIDE pictures of every STRIDE-th pixel, so that neighbours in y are
// neighbours there too. Numbers of y and dx are summed in one order, whatever the tiles.
#include "lib/lanes.clh"

#ifndef K
#define K 3
#define STRIDE 1
#endif
#define HALO ((K - 1) / STRIDE)  // rows and columns that a tile reads beyond as many as it writes, of each picture
#define PATCH 4096               // numbers of local memory; host/ops/nn/depthwise.cpp cuts tiles to fit
#define UNROLL _Pragma("unroll")
#if GROUP == 1
typedef lanes __attribute__((aligned(sizeof(real)))) loose_lanes;
#else
typedef lanes loose_lanes;
#endif
#define PATCH_LANES(at) (*(local const loose_lanes *)(patch + (at)))

// to[c] = row[left + step c] for every c below n, or 0 beyond the row's ends; `step` is 1 or 2.
static inline void copy_row(local real *to, global const real *row, const int left, const int step, const int width,
                            const int n) {
#if GROUP == 1
  const int begin = clamp((step - 1 - left) / step, 0, n), end = clamp((width - left + step - 1) / step, begin, n);
  global const real *from = row + left;
  int c = 0;
  for (; c < begin; ++c) to[c] = R(0);
  if (step == 1)
    for (; c + 16 <= end; c += 16) vstore16(vload16(0, from + c), 0, to + c);
  else  // the odd ones are read, too: of the last one there may be none
    for (; c + 16 < end; c += 16)
      vstore16((real16)(vload16(0, from + 2 * c).even, vload16(0, from + 2 * c + 16).even), 0, to + c);
  for (; c < end; ++c) to[c] = from[step * c];
  for (; c < n; ++c) to[c] = R(0);
#else
  for (int c = (int)get_local_id(0); c < n; c += GROUP) {
    const int column = left + step * c;
    to[c] = column >= 0 && column < width ? row[column] : R(0);
  }
#endif
}

// patch[(a step + b) rows + r][c] = x[top + step r + a][left + step c + b], or 0 beyond the picture.
static inline void load_patch(local real *patch, global const real *x, const int height, const int width, const int top,
                              const int left, const int rows, const int pitch, const int step) {
  for (int a = 0; a < step; ++a)
    for (int b = 0; b < step; ++b)
      for (int r = 0; r < rows; ++r) {
        const int y = top + step * r + a;
        const bool inside = y >= 0 && y < height;
        copy_row(patch + ((a * step + b) * rows + r) * pitch, x + (inside ? (ulong)y * width : 0), left + b, step,
                 inside ? width : 0, pitch);
      }
}

// Where tap (ky, kx) finds what it multiplies for the tile's row j and column i.
#define TAP(ky, kx, j, i) \
  (((((ky) % STRIDE) * STRIDE + (kx) % STRIDE) * rows + (j) + (ky) / STRIDE) * pitch + (i) + (kx) / STRIDE)

// Tiles lie side by side along z of the grid, `across` in a row of them.
#define TILE_OF(index)                                                                        \
  const int first_row = (index) / across * tile_height, first_column = (index) % across * tile_width; \
  const int tile_rows = min(tile_height, out_height - first_row);                             \
  const int tile_columns = min(tile_width, out_width - first_column);

kernel void depthwise(IN(x), IN(w), IN(bias), OUT(y), const int height, const int width, const int out_height,
                      const int out_width, const int pad_y, const int pad_x, const int tile_height,
                      const int tile_width, const int pitch, const int across) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1), tile = (int)get_group_id(2);
  const int rows = tile_height + HALO;
  local real patch[PATCH];
  TILE_OF(tile)
  load_patch(patch, AT(x, n) + (ulong)c * height * width, height, width, STRIDE * first_row - pad_y,
             STRIDE * first_column - pad_x, rows, pitch, STRIDE);
  GROUP_BARRIER;
  global const real *weights = AT(w, c);
  const real shift = AT(bias, 0)[c];
  global real *to = AT(y, n) + ((ulong)c * out_height + first_row) * out_width + first_column;
  for (int j = 0; j < tile_rows; ++j)
    FOR_ROW(i, tile_columns) {
      lanes sum = (lanes)(shift);
      UNROLL for (int ky = 0; ky < K; ++ky)
        UNROLL for (int kx = 0; kx < K; ++kx)
          sum = fma((lanes)(weights[ky * K + kx]), PATCH_LANES(TAP(ky, kx, j, i)), sum);
      lanes_store(sum, to + (ulong)j * out_width + i, tile_columns - i);
    }
}

// dx from dy and w. Row y of x is seen by rows (y + pad_y - ky) / STRIDE of y, where that is whole: with
// y = STRIDE j + a - pad_y % STRIDE, by row j + pad_y / STRIDE - m for every ky = a + STRIDE m. Tiles are of (j, i), and
// out_height, out_width count those.
kernel void depthwise_data(IN(dy), IN(w), OUT(dx), const int height, const int width, const int dy_height,
                           const int dy_width, const int out_height, const int out_width, const int pad_y,
                           const int pad_x, const int tile_height, const int tile_width, const int pitch,
                           const int across) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1), tile = (int)get_group_id(2);
  local real patch[PATCH];
  TILE_OF(tile)
  load_patch(patch, AT(dy, n) + (ulong)c * dy_height * dy_width, dy_height, dy_width,
             first_row + pad_y / STRIDE - HALO, first_column + pad_x / STRIDE - HALO, tile_height + HALO, pitch, 1);
  GROUP_BARRIER;
  global const real *weights = AT(w, c);
  global real *plane = AT(dx, n) + (ulong)c * height * width;
  UNROLL for (int a = 0; a < STRIDE; ++a)
    UNROLL for (int b = 0; b < STRIDE; ++b)
      for (int j = 0; j < tile_rows; ++j) {
        const int row = STRIDE * (first_row + j) + a - pad_y % STRIDE;
        if (row < 0 || row >= height) continue;
        FOR_ROW(i, tile_columns) {
          lanes sum = (lanes)(R(0));
          UNROLL for (int ky = a; ky < K; ky += STRIDE)
            UNROLL for (int kx = b; kx < K; kx += STRIDE)
              sum = fma((lanes)(weights[ky * K + kx]),
                        PATCH_LANES((j + HALO - ky / STRIDE) * pitch + i + HALO - kx / STRIDE), sum);
          global real *to = plane + (ulong)row * width;
#if STRIDE == 1
          lanes_store(sum, to + first_column + i, tile_columns - i);
#elif GROUP == 1
          real part[LANES];
          vstore16(sum, 0, part);
          for (int k = 0; k < min(LANES, tile_columns - i); ++k) {
            const int column = STRIDE * (first_column + i + k) + b - pad_x % STRIDE;
            if (column >= 0 && column < width) to[column] = part[k];
          }
#else
          const int column = STRIDE * (first_column + i) + b - pad_x % STRIDE;
          if (column >= 0 && column < width) to[column] = sum;
#endif
        }
      }
}

// dw[n,c,ky,kx] = sum over j, i of dy[n,c,j,i] x[n,c, STRIDE j + ky - pad_y, STRIDE i + kx - pad_x]; the batch is summed
// afterwards.
kernel void depthwise_weights(IN(x), IN(dy), OUT(dw), const int height, const int width, const int out_height,
                              const int out_width, const int pad_y, const int pad_x, const int tile_height,
                              const int tile_width, const int pitch, const int across, const int tiles) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1);
  const int rows = tile_height + HALO;
  local real patch[PATCH];
  GROUP_SCRATCH(scratch);
  lanes sums[K * K];
  for (int k = 0; k < K * K; ++k) sums[k] = (lanes)(R(0));
  for (int tile = 0; tile < tiles; ++tile) {
    TILE_OF(tile)
    GROUP_BARRIER;  // everybody is done with the last tile's
    load_patch(patch, AT(x, n) + (ulong)c * height * width, height, width, STRIDE * first_row - pad_y,
               STRIDE * first_column - pad_x, rows, pitch, STRIDE);
    GROUP_BARRIER;
    global const real *from = AT(dy, n) + ((ulong)c * out_height + first_row) * out_width + first_column;
    UNROLL for (int ky = 0; ky < K; ++ky) {
      lanes row[K];
      UNROLL for (int kx = 0; kx < K; ++kx) row[kx] = sums[ky * K + kx];
      for (int j = 0; j < tile_rows; ++j)
        FOR_ROW(i, tile_columns) {
          const lanes d = lanes_load(from + (ulong)j * out_width + i, tile_columns - i);
          UNROLL for (int kx = 0; kx < K; ++kx) row[kx] = fma(d, PATCH_LANES(TAP(ky, kx, j, i)), row[kx]);
        }
      UNROLL for (int kx = 0; kx < K; ++kx) sums[ky * K + kx] = row[kx];
    }
  }
  global real *to = AT(dw, n) + (ulong)c * K * K;
  for (int k = 0; k < K * K; ++k) {
    const real sum = group_sum(sums[k], scratch);
    if (get_local_id(0) == 0) to[k] = sum;
  }
}
