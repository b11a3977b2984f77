// Light from painted spheres in one kernel: their look-up (light/shells.cl) and compositing (light/composite.cl), in
// which a sphere that the ray leaves ahead is a segment of length 1.
//
// shells, range, radii as in light/shells.cl; points: camera metres, {1, 3, pixels, samples} or, with per_row, {1, 3,
// pixels, 1}; direction {1, 3, pixels, samples}, camera frame, any length, (0, 0, 0) looks along +z as unit3() has it;
// radiance {1, 3, pixels, samples}, zeroed before. With `listed` only the rays list[0 ... count - 1] are asked, else all
// of the tile. A work-item takes LANES rays. For inference: no adjoint.
#include "lib/chunk.clh"
#include "lib/frame.clh"
#include "lib/lanes.clh"

#define LANE(v, l) (((real *)&(v))[l])

// packed {K, rows, columns + 1, 4}: red, green, blue, density of a texel side by side, the first column once more
// behind the last, so that a texel and its neighbour are eight numbers in a row.
kernel void pack_shells(IN(shells), OUT(packed), const int count, const int rows, const int columns) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1);
  if (x > columns || y >= count * rows) return;
  const int k = y / rows;
  global const real *from = AT(shells, k) + (y - k * rows) * columns + (x < columns ? x : 0);
  global real *to = AT(packed, 0) + 4 * (y * (columns + 1) + x);
  for (int c = 0; c < 4; ++c) to[c] = from[c * rows * columns];
}

// sphere_exit() of lib/sphere.clh.
static inline lanes sphere_exits(const lanes *p, const lanes *d, real radius) {
  const lanes distance = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]), b = p[0] * d[0] + p[1] * d[1] + p[2] * d[2];
  const lanes c = (distance - radius) * (distance + radius), inside = b * b - c;
  const lanes_mask none = inside <= R(0) || (c >= R(0) && b >= R(0));
  const lanes root = sqrt(WHERE(none, R(1), inside));
  return WHERE(none, R(0), WHERE(b > R(0), -c / (b + root), root - b));
}

kernel void ask_shells(IN(packed), IN(points), IN(direction), IN(range), IN(radii), IN_INT(list), IN_INT(count),
                       OUT(radiance), CHUNK_ARGS, const int listed, const int per_row, const int spheres,
                       const int rows, const int columns) {
  const int first = (int)get_global_id(0) * LANES, asked = listed ? AT(count, 0)[0] : pixels * sample_capacity;
  if (first >= asked) return;
  int rays[LANES];
  lanes p[3], d[3];
  for (int l = 0; l < LANES; ++l) {
    const int i = min(first + l, asked - 1), ray = listed ? AT(list, 0)[i] : i;
    const ulong plane = per_row ? (ulong)pixel_capacity : RAY_PLANE;
    global const real *from = AT(points, 0) + (per_row ? ray / sample_capacity : ray), *along = AT(direction, 0) + ray;
    for (int c = 0; c < 3; ++c) LANE(p[c], l) = from[c * plane], LANE(d[c], l) = along[c * RAY_PLANE];
    rays[l] = ray;
  }
  const real scale = AT(range, 0)[0];
  const lanes size = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (int c = 0; c < 3; ++c) p[c] /= scale, d[c] = WHERE(size == R(0), R(c == 2), d[c] / size);

  lanes depth = (lanes)(R(0)), sum[3] = {depth, depth, depth};
  const int across_row = columns + 1, last = rows * across_row - across_row - 2;
  for (int k = 0; k < spheres; ++k) {
    const lanes t = sphere_exits(p, d, AT(radii, k)[0]);
    const lanes_mask ahead = t > R(0);
    lanes at[3];
    for (int c = 0; c < 3; ++c) at[c] = WHERE(ahead, p[c] + t * d[c], d[c]);
    const lanes level = sqrt(at[0] * at[0] + at[2] * at[2]);
    const lanes azimuth = WHERE(level == R(0), R(0), atan2(at[0], -at[2]));
    const lanes x = (R(0.5) + R(0.5) * INV_PI * azimuth) * (real)columns - R(0.5), left = floor(x), across = x - left;
    const lanes y = INV_PI * atan2(level, at[1]) * (real)rows - R(0.5);
    const lanes column = fmin(WHERE(left < R(0), left + (real)columns, left), (lanes)((real)(columns - 1)));
    const lanes row = fmin(fmax(floor(y), (lanes)(R(0))), (lanes)((real)(rows - 2)));
    const lanes down = fmin(fmax(y - row, (lanes)(R(0))), (lanes)(R(1))), texel = row * (real)across_row + column;
    lanes seen[4];
    for (int l = 0; l < LANES; ++l) {
      const int cell = clamp((int)LANE(texel, l), 0, last);  // of a direction that is not a number, anywhere
      global const real *upper_left = AT(packed, 0) + 4 * (k * rows * across_row + cell);
      const real8 upper = vload8(0, upper_left), lower = vload8(0, upper_left + 4 * across_row);
      const real4 above = upper.lo + LANE(across, l) * (upper.hi - upper.lo);
      const real4 below = lower.lo + LANE(across, l) * (lower.hi - lower.lo);
      const real4 value = above + LANE(down, l) * (below - above);
      LANE(seen[0], l) = value.x, LANE(seen[1], l) = value.y, LANE(seen[2], l) = value.z, LANE(seen[3], l) = value.w;
    }
    const lanes thickness = k + 1 == spheres ? seen[3] : WHERE(ahead, seen[3], R(0));
    const lanes share = exp(-depth) * -expm1(-thickness);
    for (int c = 0; c < 3; ++c) sum[c] += share * seen[c];
    depth += thickness;
  }
  for (int l = 0; l < LANES && first + l < asked; ++l) {
    global real *to = AT(radiance, 0) + rays[l];
    for (int c = 0; c < 3; ++c) to[c * RAY_PLANE] = LANE(sum[c], l);
  }
}
