// Which way the cells of a depth map face, block by block, for rays that pass cells which face away from them: Int {n, 1,
// rows, stride} in the layout of light/depth_pyramid.cl. A block is a ball around the unit normals of its cells: its
// middle c in three signed bytes, from the lowest, and its radius r in the fourth, all in steps of 1/127. A ray along d
// hits no cell of a block with d . c > r |d|. A normal that is none has no ball that ends: r = 255, and c = 0.
#include "lib/real.clh"

#define STEPS R(127)

static inline real3 unit_at(global const real *normal, const int plane, const int pixel) {
  const real3 n = (real3)(normal[pixel], normal[plane + pixel], normal[2 * plane + pixel]);
  const real most = fmax(fmax(fabs(n.x), fabs(n.y)), fabs(n.z));
  const real3 small = n / most;
  return small / sqrt(small.x * small.x + small.y * small.y + small.z * small.z);
}

// depth {n, 1, h, w}, normal {n, 3, h, w}. Writes the blocks of level `level`, w x h of them from row `to` on.
kernel void facing_level(IN(depth), IN(normal), OUT_INT(pyramid), const int level, const int to, const int w, const int h,
                         const int cells_w, const int cells_h, const int stride) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1);
  if (x >= w || y >= h) return;
  const int n = (int)get_global_id(2), plane = cells_w * cells_h;
  const int x0 = x << level, x1 = min((x + 1) << level, cells_w);
  const int y0 = y << level, y1 = min((y + 1) << level, cells_h);
  real3 sum = (real3)(R(0));
  real count = R(0);
  for (int j = y0; j < y1; ++j)
    for (int i = x0; i < x1; ++i)
      if (AT(depth, n)[j * cells_w + i] > R(0)) {
        sum += unit_at(AT(normal, n), plane, j * cells_w + i);
        count += R(1);
      }
  const real3 middle = sum * (STEPS / fmax(count, R(1)));
  const int3 c = (int3)((int)rint(middle.x), (int)rint(middle.y), (int)rint(middle.z));
  const real3 from = (real3)((real)c.x, (real)c.y, (real)c.z) / STEPS;
  real farthest = R(0);
  for (int j = y0; j < y1; ++j)
    for (int i = x0; i < x1; ++i)
      if (AT(depth, n)[j * cells_w + i] > R(0)) {
        const real3 off = unit_at(AT(normal, n), plane, j * cells_w + i) - from;
        const real square = off.x * off.x + off.y * off.y + off.z * off.z;
        farthest = square > farthest ? square : isfinite(square) ? farthest : R(INFINITY);
      }
  // A step more than it needs: what float gets wrong of a product of unit vectors is far below one.
  const int r = farthest < R(4) ? min((int)(STEPS * sqrt(farthest)) + 1, 255) : 255;
  AT(pyramid, n)[(to + y) * stride + x] =
      r == 255 ? (int)(255u << 24) : (int)(((uint)r << 24) | ((uint)(c.z & 255) << 16) | ((uint)(c.y & 255) << 8) | (uint)(c.x & 255));
}
