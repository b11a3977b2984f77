// The pyramid of largest inverse depths that screen-space rays march over: {n, 1, rows, stride}.
// Level 0 holds 1/z of every pixel, -1 where there is no measurement; a cell of level l + 1 holds the largest of its
// up to 2 x 2 cells in level l. A ray whose inverse depth stays above a block's cannot meet it. Level l is
// ceil(w / 2^l) x ceil(h / 2^l) and starts at row (2 H) - (2 H >> l), H the power of two not below h: a kernel finds it by
// a shift. The stride is odd in cache lines, so that a column does not fall into one set of the cache.
#include "lib/camera.clh"

// depth: {n, 1, h, w}, axial, metres, 0 = none. Writes level 0 and -1 everywhere else.
kernel void pyramid_base(IN(depth), OUT(pyramid), const int w, const int h, const int stride, const int level_rows) {
  const int x = (int)get_global_id(0);
  const int y = (int)get_global_id(1);
  if (x >= stride || y >= level_rows) return;
  const int n = (int)get_global_id(2);
  const real z = x < w && y < h ? AT(depth, n)[y * w + x] : R(0);
  AT(pyramid, n)[y * stride + x] = is_depth(z) ? R(1) / z : R(-1);
}

// One level, w x h cells that start at row `to`, from the one below, below_w x below_h at row `from`.
kernel void pyramid_level(OUT(pyramid), const int from, const int below_w, const int below_h, const int to, const int w,
                          const int h, const int stride) {
  const int x = (int)get_global_id(0);
  const int y = (int)get_global_id(1);
  if (x >= w || y >= h) return;
  const int n = (int)get_global_id(2);
  global const real *below = AT(pyramid, n) + from * stride;
  const int x0 = 2 * x, x1 = min(2 * x + 1, below_w - 1);
  const int y0 = 2 * y * stride, y1 = min(2 * y + 1, below_h - 1) * stride;
  AT(pyramid, n)[(to + y) * stride + x] =
      fmax(fmax(below[y0 + x0], below[y0 + x1]), fmax(below[y1 + x0], below[y1 + x1]));
}
