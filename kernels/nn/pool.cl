// Pooling of {N, C, H, W}, stride 2. Rows: one plane.
#include "lib/lanes.clh"

#define FOR_LANES(x, w) for (int x = (int)get_local_id(0); x < (w); x += GROUP)

// y = mean of 2x2; an odd last row or column is left out. y: {N, C, H/2, W/2}.
kernel void average_pool(IN(x), OUT(y), const int height, const int width) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1);
  const int h = height / 2, w = width / 2;
  global const real *from = AT(x, n) + (ulong)c * height * width;
  global real *to = AT(y, n) + (ulong)c * h * w;
  for (int j = 0; j < h; ++j) {
    global const real *a = from + 2 * j * width;
    FOR_LANES(i, w)
      to[j * w + i] = R(0.25) * ((a[2 * i] + a[2 * i + 1]) + (a[width + 2 * i] + a[width + 2 * i + 1]));
  }
}

kernel void average_pool_adjoint(IN(dy), OUT(dx), const int height, const int width) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1);
  const int h = height / 2, w = width / 2;
  global const real *from = AT(dy, n) + (ulong)c * h * w;
  global real *to = AT(dx, n) + (ulong)c * height * width;
  for (int j = 0; j < height; ++j)
    FOR_LANES(i, width)
      to[j * width + i] = j < 2 * h && i < 2 * w ? R(0.25) * from[(j / 2) * w + i / 2] : R(0);
}

// The maximum of one window, and where it is: window dy + dx of the first in reading order. A NaN is larger than all.
static inline real max_of_window(global const real *from, int *which, int j, int i, const int height, const int width,
                                 const int window, const int pad) {
  real best = -INFINITY;
  int at = pad * (window + 1);  // always inside
  for (int dy = 0; dy < window; ++dy)
    for (int dx = 0; dx < window; ++dx) {
      const int sy = 2 * j - pad + dy, sx = 2 * i - pad + dx;
      const bool inside = sy >= 0 && sy < height && sx >= 0 && sx < width;
      const real v = inside ? from[sy * width + sx] : -INFINITY;
      const bool better = v > best || isnan(v);
      best = better ? v : best;
      at = better ? window * dy + dx : at;
    }
  *which = at;
  return best;
}

#if GROUP == 1
// The same of sixteen windows side by side, all of whose columns and 33 pixels of each row lie inside.
static inline real16 max_of_windows(global const real *from, mask16 *which, int j, int i, const int height,
                                    const int width, const int window, const int pad) {
  real16 best = (real16)(-INFINITY);
  mask16 at = (mask16)(pad * (window + 1));
  for (int dy = max(0, pad - 2 * j); dy < min(window, height + pad - 2 * j); ++dy) {
    global const real *row = from + (2 * j - pad + dy) * width + 2 * i - pad;
    const real16 a = vload16(0, row), b = vload16(1, row);
    const real16 even = (real16)(a.even, b.even);
    const real16 column[3] = {even, (real16)(a.odd, b.odd), (real16)(even.s12345678, even.s9abc, even.sdef, row[32])};
    for (int dx = 0; dx < window; ++dx) {
      const mask16 better = (column[dx] > best) | (column[dx] != column[dx]);
      best = select(best, column[dx], better);
      at = select(at, (mask16)(window * dy + dx), better);
    }
  }
  *which = at;
  return best;
}
#endif

// y = maximum over window x window (3 with padding 1, or 2 with none; padding is never chosen); y: {N, C, (H + 2 pad -
// window)/2 + 1, ...}. which: window dy + dx of the first maximum in reading order, which is where the gradient goes.
kernel void max_pool(IN(x), OUT(y), OUT_INT(which), const int height, const int width, const int window,
                     const int pad) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1);
  const int h = (height + 2 * pad - window) / 2 + 1, w = (width + 2 * pad - window) / 2 + 1;
  global const real *from = AT(x, n) + (ulong)c * height * width;
  global real *to = AT(y, n) + (ulong)c * h * w;
  global int *code = AT(which, n) + (ulong)c * h * w;
  for (int j = 0; j < h; ++j) {
#if GROUP == 1
    const int inside = pad;  // the first window that does not begin in the padding
    for (int i = 0; i < w;) {
      if (i >= inside && 2 * i - pad + 33 <= width) {
        mask16 at;
        vstore16(max_of_windows(from, &at, j, i, height, width, window, pad), 0, to + j * w + i);
        vstore16(convert_int16(at), 0, code + j * w + i);
        i += 16;
      } else {
        int at;
        to[j * w + i] = max_of_window(from, &at, j, i, height, width, window, pad);
        code[j * w + i] = at;
        ++i;
      }
    }
#else
    FOR_LANES(i, w) {
      int at;
      to[j * w + i] = max_of_window(from, &at, j, i, height, width, window, pad);
      code[j * w + i] = at;
    }
#endif
  }
}

// Each input looks at the windows it lies in (at most two per axis): a gather, so the order is fixed.
kernel void max_pool_adjoint(IN(dy), IN_INT(which), OUT(dx), const int height, const int width, const int window,
                             const int pad) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1);
  const int h = (height + 2 * pad - window) / 2 + 1, w = (width + 2 * pad - window) / 2 + 1;
  global const real *from = AT(dy, n) + (ulong)c * h * w;
  global const int *code = AT(which, n) + (ulong)c * h * w;
  global real *to = AT(dx, n) + (ulong)c * height * width;
  for (int sy = 0; sy < height; ++sy)
    FOR_LANES(sx, width) {
      real sum = R(0);
      for (int j = max(sy + pad - window + 2, 0) / 2; j <= (sy + pad) / 2 && j < h; ++j)
        for (int i = max(sx + pad - window + 2, 0) / 2; i <= (sx + pad) / 2 && i < w; ++i)
          if (code[j * w + i] == window * (sy - 2 * j + pad) + (sx - 2 * i + pad)) sum += from[j * w + i];
      to[sy * width + sx] = sum;
    }
}
