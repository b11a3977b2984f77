// Light from concentric spheres around the camera, each painted with radiance and density (a multi-sphere image, Attal
// et al. 2020, ECCV): what a ray from any point meets where it leaves each of them.
//
// shells {K, 4, rows, columns}: panoramas (host/math/panorama.hpp: the centre column looks along -z, the top row along
// +y), the innermost first. points, direction {1, 3, pixels, samples}: camera metres, any length; range {1, 3, 1, 1}:
// scene_scale first, metres; radii {K, 1, 1, 1} in that unit. value {K, 4, pixels, samples}: bilinear between texel
// centres, around the seam, constant beyond the first and last row's; met {K, 1, ...}: 1 where the ray leaves the
// sphere ahead, always on the last: a ray that starts beyond it reads it by its own direction. Elsewhere value is 0.
// For the adjoint: cell Int {1, 1, 1, K pixels samples}: k rows columns + texel to the upper left, or -1 where nothing
// was read; share {K, 2, ...}: what of the value is the next column's and row's.
#include "lib/chunk.clh"
#include "lib/sphere.clh"

// Texel to the upper left, share of the next column and row.
typedef struct {
  int column, row, met;
  real across, down;
} ShellCell;

static inline ShellCell shell_cell(real3 origin, real3 d, real radius, int last, int rows, int columns) {
  const real t = sphere_exit(origin, d, radius);
  const real3 at = t > R(0) ? origin + t * d : d;
  const real level = sqrt(at.x * at.x + at.z * at.z);
  const real azimuth = level > R(0) ? atan2(at.x, -at.z) : R(0);
  const real x = (R(0.5) + R(0.5) * INV_PI * azimuth) * (real)columns - R(0.5);
  const real y = INV_PI * atan2(level, at.y) * (real)rows - R(0.5);
  ShellCell c;
  c.met = t > R(0) || last;
  const int left = (int)floor(x);
  c.across = x - (real)left;
  c.column = clamp(left < 0 ? left + columns : left, 0, columns - 1);  // of what is not a number too
  c.row = clamp((int)floor(y), 0, rows - 2);
  c.down = clamp(y - (real)c.row, R(0), R(1));
  return c;
}

kernel void look_up_shells(IN(shells), IN(points), IN(direction), IN(range), IN(radii), OUT(value), OUT(met),
                           OUT_INT(cell), OUT(share), CHUNK_ARGS, const int count, const int rows, const int columns) {
  RAY_OF_WORK_ITEM
  global const real *from = AT(points, 0) + ray, *along = AT(direction, 0) + ray;
  const real3 origin = (real3)(from[0], from[RAY_PLANE], from[2 * RAY_PLANE]) / AT(range, 0)[0];
  const real3 d = unit3((real3)(along[0], along[RAY_PLANE], along[2 * RAY_PLANE]));
  for (int k = 0; k < count; ++k) {
    const ShellCell c = shell_cell(origin, d, AT(radii, k)[0], k == count - 1, rows, columns);
    const int next = c.column + 1 < columns ? c.column + 1 : 0;
    const int top = c.row * columns, bottom = top + columns;
    for (int channel = 0; channel < 4; ++channel) {
      global const real *map = AT(shells, k) + channel * rows * columns;
      const real upper = map[top + c.column] + c.across * (map[top + next] - map[top + c.column]);
      const real lower = map[bottom + c.column] + c.across * (map[bottom + next] - map[bottom + c.column]);
      AT(value, k)[channel * RAY_PLANE + ray] = c.met ? upper + c.down * (lower - upper) : R(0);
    }
    AT(met, k)[ray] = c.met ? R(1) : R(0);
    AT(cell, 0)[k * RAY_PLANE + ray] = c.met ? k * rows * columns + top + c.column : -1;
    AT(share, k)[ray] = c.across, AT(share, k)[RAY_PLANE + ray] = c.down;
  }
}

// The transpose of the look-up: every texel sums what rays bring that read it, in their order. order, starts: rays by
// cell (kernels/light/sort_rays.cl).
kernel void sum_shells(IN(g), IN(share), IN_INT(order), IN_INT(starts), OUT(d_shells), const int rays,
                       const int count, const int rows, const int columns) {
  const int i = (int)get_global_id(0);
  if (i >= count * rows * columns) return;
  const int k = i / (rows * columns), texel = i - k * rows * columns, y = texel / columns, x = texel - y * columns;
  const ulong plane = (ulong)rays;
  const int before = x > 0 ? x - 1 : columns - 1;
  real4 sum = (real4)(R(0));
  for (int row = max(y - 1, 0); row <= min(y, rows - 2); ++row)
    for (int side = 0; side < 2; ++side) {
      const int cell = (k * rows + row) * columns + (side ? x : before), end = AT(starts, 0)[cell + 1];
      for (int j = AT(starts, 0)[cell]; j < end; ++j) {
        const ulong ray = (ulong)(AT(order, 0)[j] - k * rays);
        const real across = AT(share, k)[ray], down = AT(share, k)[plane + ray];
        const real weight = (side ? R(1) - across : across) * (row == y ? R(1) - down : down);
        global const real *from = AT(g, k) + ray;
        sum += weight * (real4)(from[0], from[plane], from[2 * plane], from[3 * plane]);
      }
    }
  global real *to = AT(d_shells, k) + texel;
  to[0] = sum.x, to[rows * columns] = sum.y, to[2 * rows * columns] = sum.z, to[3 * rows * columns] = sum.w;
}
