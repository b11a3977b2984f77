// Sums of ray tensors over a pixel's samples: {1, C, pixels, samples} to columns {1, C, pixels, 1}, 0 beyond the chunk.
// Rows go by lanes and then a tree (lib/lanes.clh): one order per device.
#include "lib/chunk.clh"
#include "lib/lanes.clh"

kernel void sum_samples(IN(x), OUT(y), CHUNK_ARGS) {
  const int p = (int)get_group_id(0), c = (int)get_group_id(1);
  GROUP_SCRATCH(scratch);
  if (p >= pixel_capacity) return;
  global const real *row = AT(x, 0) + c * RAY_PLANE + RAY(p, 0);
  lanes sum = R(0);
  if (p < pixels) {
    FOR_ROW(i, samples) sum += lanes_load(row + i, samples - i);
  }
  const real total = group_sum(sum, scratch);
  if (get_local_id(0) == 0) AT(y, 0)[c * pixel_capacity + p] = total;
}
