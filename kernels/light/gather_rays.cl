// What a map holds at the pixels that rays hit, and back. map {n, C, h, w}; hit Int and rays {1, C, pixels, samples} as
// in kernels/light/sort_rays.cl. Rows: a block of rays, or of a picture's pixels, of one channel; channel after
// channel, so that what is looked up at random lies in one plane at a time.
#include "lib/chunk.clh"
#include "lib/lanes.clh"

// y = map at the hit pixel, 0 on a miss.
kernel void gather_rays(IN(map), IN_INT(hit), OUT(y), CHUNK_ARGS, const int items, const int plane, const int block) {
  const int first = (int)get_group_id(0) * block, length = min(block, pixels * sample_capacity - first);
  const ulong c = (ulong)get_group_id(1);
  global const int *from = AT(hit, 0) + first;
  global real *to = AT(y, 0) + c * RAY_PLANE + first;
  FOR_ROW(i, length) {
    const int p = (first + i) / sample_capacity, s = first + i - p * sample_capacity;
    global const real *values = AT(map, min((first_pixel + p) / plane, items - 1)) + c * (ulong)plane;
    for (int l = 0; l < LANES; ++l) {
      const int pixel = s + l < samples ? from[i + l] : -1;
      to[i + l] = pixel >= 0 ? values[pixel] : R(0);
    }
  }
}

// What the rays order[begin ... end - 1] bring, in their order, with Kahan's compensation: a lamp's pixel may be hit by
// all rays of a chunk.
static inline real segment_sum(global const real *from, global const int *order, const int begin, const int end) {
  real sum = R(0), lost = R(0);
  for (int i = begin; i < end; ++i) {
    const real value = from[order[i]] - lost, next = sum + value;
    lost = (next - sum) - value;
    sum = next;
  }
  return sum;
}

// The transpose: every pixel sums what its rays bring. order, starts: from sort_rays.
kernel void sum_segments(IN(g), IN_INT(order), IN_INT(starts), OUT(y), const int rays, const int plane,
                         const int block) {
  const int first = (int)get_group_id(0) * block, n = (int)get_group_id(2), length = min(block, plane - first);
  const ulong c = (ulong)get_group_id(1);
  global const real *from = AT(g, 0) + c * (ulong)rays;
  global const int *begin = AT(starts, 0) + n * plane + first;
  global real *to = AT(y, n) + c * (ulong)plane + first;
  FOR_ROW(i, length) {
    const int count = min(LANES, length - i);
    if (begin[i] == begin[i + count])
      lanes_store((lanes)(R(0)), to + i, count);
    else
      for (int l = 0; l < count; ++l) to[i + l] = segment_sum(from, AT(order, 0), begin[i + l], begin[i + l + 1]);
  }
}
