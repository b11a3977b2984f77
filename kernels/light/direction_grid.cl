// A net's answers on a grid of directions around each surface, in place of one answer for each ray.
//
// The grid of a pixel: side x side directions that leave its surface, over the hemisphere about its normal, by the
// octahedral map of a hemisphere (Cigolle et al. 2014, JCGT 3(2)), whose edge is the horizon: nothing wraps. Grid point
// j * side + i is the middle of that cell, at (i + 1/2, j + 1/2) * 2 / side - 1: none is at the horizon, where nets have
// learned little. normal {1, 3, h, w}, camera frame, of any length but zero.
#include "lib/chunk.clh"
#include "lib/frame.clh"
#include "lib/surface.clh"

static inline Frame frame_at(global const real *normal, const int plane, const int pixel) {
  const real3 v = (real3)(normal[pixel], normal[plane + pixel], normal[2 * plane + pixel]);
  return frame_of(unit3(v / unit_near(v)));
}

// direction {1, 3, plane, side^2}: of a ray that meets the surface there, the other way round; pixel Int {1, 1, ...}.
kernel void grid_directions(IN(normal), OUT(direction), OUT_INT(pixel), const int plane, const int side) {
  const int s = (int)get_global_id(0), p = (int)get_global_id(1);
  if (s >= side * side || p >= plane) return;
  const int j = s / side, i = s - j * side;
  const real step = R(2) / (real)side, x = ((real)i + R(0.5)) * step - R(1), y = ((real)j + R(0.5)) * step - R(1);
  const real a = R(0.5) * (x + y), b = R(0.5) * (x - y);
  const real3 local_one = unit3((real3)(a, b, fmax(R(1) - fabs(a) - fabs(b), R(0))));
  const real3 d = to_world(frame_at(AT(normal, 0), plane, p), local_one);
  const ulong at = (ulong)p * (ulong)(side * side) + (ulong)s, step_c = (ulong)plane * (ulong)(side * side);
  global real *to = AT(direction, 0) + at;
  to[0] = -d.x, to[step_c] = -d.y, to[2 * step_c] = -d.z;
  AT(pixel, 0)[at] = p;
}

// y {1, C, pixels, samples}, zeroed before: what the grid {1, C, plane, side^2} of the pixel that a ray hits holds
// along it, between four grid points, beyond the outer ones what these hold; of a ray from below the horizon what the
// horizon has, from straight below the zenith. hit Int and direction as in light/ask_mlp.cl, as are listed, list, count.
kernel void look_up_grid(IN(grid), IN(normal), IN_INT(hit), IN(direction), IN_INT(list), IN_INT(count), OUT(y),
                         CHUNK_ARGS, const int listed, const int channels, const int plane, const int side) {
  const int k = (int)get_global_id(0), asked = listed ? AT(count, 0)[0] : pixels * sample_capacity;
  if (k >= asked) return;
  const int ray = listed ? AT(list, 0)[k] : k;
  const int pixel = ray % sample_capacity < samples ? AT(hit, 0)[ray] : -1;  // beyond a chunk's samples nobody has written
  if (pixel < 0) return;
  global const real *along = AT(direction, 0) + ray;
  const real3 d = (real3)(-along[0], -along[RAY_PLANE], -along[2 * RAY_PLANE]);
  const real3 v = to_local(frame_at(AT(normal, 0), plane, pixel), d);
  const real size = fabs(v.x) + fabs(v.y) + fmax(v.z, R(0)), scale = size > R(0) ? R(1) / size : R(0);
  const real half_side = R(0.5) * (real)side, most = (real)(side - 1), a = v.x * scale, b = v.y * scale;
  const real x = clamp(half_side * (R(1) + a + b) - R(0.5), R(0), most);
  const real z = clamp(half_side * (R(1) + a - b) - R(0.5), R(0), most);
  const int i = clamp((int)x, 0, side - 2), j = clamp((int)z, 0, side - 2);
  const real right = x - (real)i, down = z - (real)j;
  const ulong step = (ulong)plane * (ulong)(side * side);
  global const real *from = AT(grid, 0) + (ulong)pixel * (ulong)(side * side) + (ulong)(j * side + i);
  for (int c = 0; c < channels; ++c, from += step) {
    const real above = from[0] + right * (from[1] - from[0]);
    const real below = from[side] + right * (from[side + 1] - from[side]);
    AT(y, 0)[(ulong)c * RAY_PLANE + (ulong)ray] = above + down * (below - above);
  }
}
