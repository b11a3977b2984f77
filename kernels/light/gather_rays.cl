// What a map holds at the pixels that rays hit, and back. map {n, C, h, w}; hit Int and rays {1, C, pixels, samples} as in
// kernels/light/sort_rays.cl.
#include "lib/chunk.clh"

// y = map at the hit pixel, 0 on a miss.
kernel void gather_rays(IN(map), IN_INT(hit), OUT(y), CHUNK_ARGS, const int items, const int channels,
                        const int plane) {
  RAY_OF_WORK_ITEM
  const int n = min((first_pixel + p) / plane, items - 1), pixel = AT(hit, 0)[ray];
  const int seen = s < samples && pixel >= 0;
  global const real *from = AT(map, n) + max(pixel, 0);
  for (int c = 0; c < channels; ++c) AT(y, 0)[c * RAY_PLANE + ray] = seen ? from[(ulong)c * (ulong)plane] : R(0);
}

// The transpose: every pixel sums what its rays bring, in their order, with Kahan's compensation: a lamp's pixel may be
// hit by all rays of a chunk. order, starts: from sort_rays.
kernel void sum_segments(IN(g), IN_INT(order), IN_INT(starts), OUT(y), const int rays, const int keys,
                         const int plane) {
  const int key = (int)get_global_id(0);
  const int c = (int)get_global_id(1);
  if (key >= keys) return;
  const int n = key / plane;
  global const real *from = AT(g, 0) + (ulong)c * (ulong)rays;
  const int end = AT(starts, 0)[key + 1];
  real sum = R(0), lost = R(0);
  for (int i = AT(starts, 0)[key]; i < end; ++i) {
    const real value = from[AT(order, 0)[i]] - lost, next = sum + value;
    lost = (next - sum) - value;
    sum = next;
  }
  AT(y, n)[(ulong)c * (ulong)plane + (key - n * plane)] = sum;
}
