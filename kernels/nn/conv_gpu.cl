// Convolution and matrix products on GPU devices: implicit GEMM in tiles of 64 x 64, both operands staged in local memory.
//
//   forward, backward data:  target[n,m,p] = bias[m] + sum_k weights[m,k] * source under tap k at position p
//   backward weights:        gradient[m,k] = sum_n,p target[n,m,p] * source under tap k at position p
//
// Geometry as in nn/conv_geometry.clh, weights as conv_pack.cl leaves them: the host contract of nn/conv_cpu.cl.
// A work-group of 16 x 16 computes a tile, a work-item 4 x 4 of it, 16 apart. Sums run in a fixed order. NCHW.
#include "nn/conv_geometry.clh"

#define TILE 64
#define DEPTH 16

// sums[4][4] += left[DEPTH][TILE]^T * right[DEPTH][TILE]
static void multiply_tiles(real *sums, local const real *left, local const real *right) {
  const int row = get_local_id(1), column = get_local_id(0);
  for (int k = 0; k < DEPTH; ++k)
    for (int i = 0; i < 4; ++i) {
      const real a = left[k * TILE + row + 16 * i];
      for (int j = 0; j < 4; ++j) sums[4 * i + j] = fma(a, right[k * TILE + column + 16 * j], sums[4 * i + j]);
    }
}

// Group (64 positions, 64 outputs, batch item).
kernel __attribute__((reqd_work_group_size(16, 16, 1))) void conv_gpu(IN(source), SOURCE_MAP_PARAMS IN(weights), IN(bias), OUT(target),
                                                                      const ConvGeometry g, const int has_bias) {
  local real left[DEPTH * TILE], right[DEPTH * TILE];
  const int item = get_local_id(1) * 16 + get_local_id(0), n = get_group_id(2);
  const int p0 = get_group_id(0) * TILE, m0 = get_group_id(1) * TILE;
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps, positions = g.grid_h * g.grid_w;
  const int panels = (g.outputs + 7) / 8;
  real sums[16];
  for (int i = 0; i < 16; ++i) sums[i] = R(0);
  for (int k0 = 0; k0 < depth; k0 += DEPTH) {
    for (int i = item; i < DEPTH * TILE; i += 256) {
      const int k = k0 + i / TILE, m = m0 + i % TILE, p = p0 + i % TILE;
      left[i] = k < depth && m / 8 < panels ? AT(weights, 0)[((ulong)(m / 8) * depth + k) * 8 + m % 8] : R(0);
      const int at = k < depth && p < positions ? source_element(g, k, p) : -1;
      right[i] = at >= 0 ? map1(SOURCE_MAP(k / taps), AT(source, n)[at]) : R(0);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    multiply_tiles(sums, left, right);
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  for (int i = 0; i < 16; ++i) {
    const int m = m0 + get_local_id(1) + 16 * (i / 4), p = p0 + get_local_id(0) + 16 * (i % 4);
    if (m < g.outputs && p < positions) {
      const int y = p / g.grid_w * g.target_step + g.target_y, x = p % g.grid_w * g.target_step + g.target_x;
      AT(target, n)[(ulong)m * g.target_plane + y * g.target_w + x] = sums[i] + (has_bias ? AT(bias, 0)[m] : R(0));
    }
  }
}

// Group (64 of depth, 64 outputs, partial). Partial s sums stretches s, s + partials, ... of DEPTH positions over all batch
// items into gradient[s][outputs][depth].
kernel __attribute__((reqd_work_group_size(16, 16, 1))) void conv_weights_gpu(IN(source), SOURCE_MAP_PARAMS IN(target), OUT(gradient),
                                                                              const ConvGeometry g, const int batch,
                                                                              const int partials) {
  local real left[DEPTH * TILE], right[DEPTH * TILE];
  const int item = get_local_id(1) * 16 + get_local_id(0), s = get_group_id(2);
  const int k0 = get_group_id(0) * TILE, m0 = get_group_id(1) * TILE;
  const int taps = g.taps_y * g.taps_x, depth = g.channels * taps, positions = g.grid_h * g.grid_w;
  const int stretches = (positions + DEPTH - 1) / DEPTH;
  real sums[16];
  for (int i = 0; i < 16; ++i) sums[i] = R(0);
  for (int q = s; q < stretches * batch; q += partials) {
    const int n = q / stretches, p0 = q % stretches * DEPTH;
    for (int i = item; i < DEPTH * TILE; i += 256) {
      const int p = p0 + i % DEPTH, m = m0 + i / DEPTH, k = k0 + i / DEPTH;
      const int y = p / g.grid_w, x = p % g.grid_w;
      const int to = i % DEPTH * TILE + i / DEPTH;
      left[to] = p < positions && m < g.outputs ? AT(target, n)[(ulong)m * g.target_plane + y * g.target_w + x] : R(0);
      const int at = p < positions && k < depth ? source_element(g, k, p) : -1;
      right[to] = at >= 0 ? map1(SOURCE_MAP(k / taps), AT(source, n)[at]) : R(0);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    multiply_tiles(sums, left, right);
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  for (int i = 0; i < 16; ++i) {
    const int m = m0 + get_local_id(1) + 16 * (i / 4), k = k0 + get_local_id(0) + 16 * (i % 4);
    if (m < g.outputs && k < depth) AT(gradient, 0)[((ulong)s * g.outputs + m) * depth + k] = sums[i];
  }
}
