// The pyramid of largest inverse depths that screen-space rays march over: {n, 1, rows, stride}.
// Level 0 holds 1/z of every pixel, -1 where there is no measurement; a cell of level l + 1 holds the largest of its up to
// 2 x 2 cells in level l. A ray whose inverse depth stays above a block's cannot meet it. Level l is
// ceil(w / 2^l) x ceil(h / 2^l) and starts at row (2 H) - (2 H >> l), H the power of two not below h: a kernel finds it by a
// shift. The stride is odd in cache lines, so that a column does not fall into one set of the cache.
// With FACING there is a second channel: a set of 24 bits, kept as a whole number below 2^24 (exact in float), that says
// from which directions a cell, or any cell of a block, could be hit on its front, direction . normal <= 0. Directions fall
// into 24 cones: octant (x < 0: 1, y < 0: 2, z < 0: 4) times 3 plus the axis along which they are longest. A cone is
// convex, so the product is positive all over it when it is so along its four edges.
#include "lib/real.clh"

// The cones with a direction d, d . n <= 0. The margin covers the rounding of the product that a ray computes.
static inline int open_directions(const real3 n) {
  const real margin = R(1e-5) * sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
  int set = 0;
  for (int octant = 0; octant < 8; ++octant) {
    const real a = (octant & 1) ? -n.x : n.x, b = (octant & 2) ? -n.y : n.y, c = (octant & 4) ? -n.z : n.z;
    const real ab = (a + b) * R(0.70710678118654752), bc = (b + c) * R(0.70710678118654752);
    const real ca = (c + a) * R(0.70710678118654752), abc = (a + b + c) * R(0.57735026918962576);
    // Not "<=": a normal that is not a number stays open, and is refused by the cell itself.
    if (!(fmin(fmin(a, ab), fmin(ca, abc)) > margin)) set |= 1 << (3 * octant);
    if (!(fmin(fmin(b, ab), fmin(bc, abc)) > margin)) set |= 2 << (3 * octant);
    if (!(fmin(fmin(c, ca), fmin(bc, abc)) > margin)) set |= 4 << (3 * octant);
  }
  return set;
}

// depth: {n, 1, h, w}, axial, metres, 0 = none; normal {n, 3, h, w}. Writes level 0 and, everywhere else, -1 and
// the empty set.
kernel void pyramid_base(IN(depth),
#ifdef FACING
                         IN(normal),
#endif
                         OUT(pyramid), const int w, const int h, const int stride, const int level_rows) {
  const int x = (int)get_global_id(0);
  const int y = (int)get_global_id(1);
  if (x >= stride || y >= level_rows) return;
  const int n = (int)get_global_id(2);
  const real z = x < w && y < h ? AT(depth, n)[y * w + x] : R(0);
  const int valid = z > R(0) && z < R(INFINITY);
  AT(pyramid, n)[y * stride + x] = valid ? R(1) / z : R(-1);
#ifdef FACING
  const int at = valid ? y * w + x : 0, plane = w * h;
  global const real *c = AT(normal, n) + at;
  const int set = valid ? open_directions((real3)(c[0], c[plane], c[2 * plane])) : 0;
  AT(pyramid, n)[(level_rows + y) * stride + x] = (real)set;
#endif
}

// One level, w x h cells that start at row `to`, from the one below, below_w x below_h at row `from`.
kernel void pyramid_level(OUT(pyramid), const int from, const int below_w, const int below_h, const int to, const int w,
                          const int h, const int stride, const int level_rows) {
  const int x = (int)get_global_id(0);
  const int y = (int)get_global_id(1);
  if (x >= w || y >= h) return;
  const int n = (int)get_global_id(2);
  global const real *below = AT(pyramid, n) + from * stride;
  const int x0 = 2 * x, x1 = min(2 * x + 1, below_w - 1);
  const int y0 = 2 * y * stride, y1 = min(2 * y + 1, below_h - 1) * stride;
  AT(pyramid, n)[(to + y) * stride + x] = fmax(fmax(below[y0 + x0], below[y0 + x1]), fmax(below[y1 + x0], below[y1 + x1]));
#ifdef FACING
  below += level_rows * stride;
  AT(pyramid, n)[(level_rows + to + y) * stride + x] =
      (real)((int)below[y0 + x0] | (int)below[y0 + x1] | (int)below[y1 + x0] | (int)below[y1 + x1]);
#endif
}
