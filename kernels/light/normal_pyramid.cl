// Which way the cells of a depth map face, block by block: rays that hit no cell facing away from them (ssrt.cl, FACING)
// pass in one step over a block in which all do. {n, 1, rows, 2 stride} of ints, levels where depth_pyramid.cl has them:
// each cell holds the corner of least and that of largest components of a box around its normals, side by side.
// Only the sign of a normal's product with a ray counts, so normals are taken over their largest component, and a corner
// is three numbers of ten bits, in steps of 1/510 from -511/510 up. A quarter of a step more on each side covers the
// roundings here and in the march: a block told to face away does so in every cell.
#include "lib/real.clh"

#define CORNER(x, y, z) ((x) + 511 | (y) + 511 << 10 | (z) + 511 << 20)
#define STEPS R(510)

// normal: {n, 3, h, w}. One that is no direction may face anywhere. Beyond the picture boxes are empty.
kernel void normal_base(IN(normal), OUT_INT(pyramid), const int w, const int h, const int stride, const int level_rows) {
  const int x = (int)get_global_id(0);
  const int y = (int)get_global_id(1);
  if (x >= stride || y >= level_rows) return;
  const int n = (int)get_global_id(2);
  global int *to = AT(pyramid, n) + 2 * (y * stride + x);
  to[0] = CORNER(511, 511, 511), to[1] = CORNER(-511, -511, -511);
  if (x >= w || y >= h) return;
  global const real *at = AT(normal, n) + y * w + x;
  const real3 v = (real3)(at[0], at[w * h], at[2 * w * h]);
  const real largest = fmax(fmax(fabs(v.x), fabs(v.y)), fabs(v.z));
  if (!(largest > R(0) && largest < R(INFINITY) && v.x == v.x && v.y == v.y && v.z == v.z)) {
    to[0] = CORNER(-511, -511, -511), to[1] = CORNER(511, 511, 511);
    return;
  }
  const real3 steps = v / largest * STEPS;
  const real3 low = floor(steps - R(0.25)), high = ceil(steps + R(0.25));
  to[0] = CORNER((int)low.x, (int)low.y, (int)low.z), to[1] = CORNER((int)high.x, (int)high.y, (int)high.z);
}

// By component; each keeps to its ten bits.
#define LEAST(a, b) (min((a) & 1023, (b) & 1023) | min((a) & 1023 << 10, (b) & 1023 << 10) | min((a) >> 20, (b) >> 20) << 20)
#define LARGEST(a, b) \
  (max((a) & 1023, (b) & 1023) | max((a) & 1023 << 10, (b) & 1023 << 10) | max((a) >> 20, (b) >> 20) << 20)

// One level, w x h cells that start at row `to`, from the one below, below_w x below_h at row `from`.
kernel void normal_level(OUT_INT(pyramid), const int from, const int below_w, const int below_h, const int to,
                         const int w, const int h, const int stride) {
  const int x = (int)get_global_id(0);
  const int y = (int)get_global_id(1);
  if (x >= w || y >= h) return;
  const int n = (int)get_global_id(2);
  global const int *below = AT(pyramid, n) + 2 * from * stride;
  const int x0 = 4 * x, x1 = 2 * min(2 * x + 1, below_w - 1);
  const int y0 = 4 * y * stride, y1 = 2 * min(2 * y + 1, below_h - 1) * stride;
  global const int *a = below + y0 + x0, *b = below + y0 + x1, *c = below + y1 + x0, *d = below + y1 + x1;
  const int low = LEAST(LEAST(a[0], b[0]), LEAST(c[0], d[0]));
  const int high = LARGEST(LARGEST(a[1], b[1]), LARGEST(c[1], d[1]));
  global int *box = AT(pyramid, n) + 2 * ((to + y) * stride + x);
  box[0] = low, box[1] = high;
}
