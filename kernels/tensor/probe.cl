// What a device must get right before it is used: see host/cl/probe.hpp. The matrix product has the shape of the packed
// one (a register tile of 12 x 32 in float16, both panels k-major) and a sum long enough for drivers that end a loop
// after 65535 turns (Mesa's llvmpipe 22.3).
#include "lib/real.clh"

#define ROWS 12

// c[i, j] = sum over k < depth of a[i, k mod period] b[k mod period, j].
// a: panels of 12 rows, b: panels of 32 columns, both k-major; c row-major.
// Work-item (x, y) computes the tile of panel x of a and panel y of b.
kernel void probe_product(global const real *a, global const real *b, global real *c, const int depth,
                          const int period) {
  const int row_panel = (int)get_global_id(0);
  const int column_panel = (int)get_global_id(1);
  const int columns = (int)get_global_size(1) * 32;
  global const real *a_panel = a + row_panel * period * ROWS;
  global const real *b_panel = b + column_panel * period * 32;
  real16 low[ROWS], high[ROWS];
#pragma unroll
  for (int i = 0; i < ROWS; ++i) low[i] = high[i] = (real16)(R(0));
#ifdef PROBE_FAULT_PRODUCT
  const int end = depth - 1;
#else
  const int end = depth;
#endif
  for (int k = 0; k < end; ++k) {
    const int row = k % period;
    const real16 b_low = vload16(0, b_panel + row * 32);
    const real16 b_high = vload16(1, b_panel + row * 32);
#pragma unroll
    for (int i = 0; i < ROWS; ++i) {
      const real16 a_value = (real16)(a_panel[row * ROWS + i]);
      low[i] = fma(a_value, b_low, low[i]);
      high[i] = fma(a_value, b_high, high[i]);
    }
  }
#pragma unroll
  for (int i = 0; i < ROWS; ++i) {
    global real *to = c + (row_panel * ROWS + i) * columns + column_panel * 32;
    vstore16(low[i], 0, to);
    vstore16(high[i], 1, to);
  }
}

// y[f, :] = f(x) for f = exp, log, sin, sqrt, reciprocal; x: 16 * vectors numbers above zero.
kernel void probe_functions(global const real *x, global real *y, const int vectors) {
  const int i = (int)get_global_id(0);
  if (i >= vectors) return;
  const real16 v = vload16(i, x);
  vstore16(exp(v), i, y);
#ifdef PROBE_FAULT_FUNCTION
  vstore16(log(v) * R(1.0001), vectors + i, y);
#else
  vstore16(log(v), vectors + i, y);
#endif
  vstore16(sin(v), 2 * vectors + i, y);
  vstore16(sqrt(v), 3 * vectors + i, y);
  vstore16(R(1) / v, 4 * vectors + i, y);
}
