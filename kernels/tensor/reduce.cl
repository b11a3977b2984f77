// Sums along axes of a tensor {N, C, H, W}, in a fixed order.
#include "lib/lanes.clh"

// y[n, c] = factor * sum over the plane of x[n, c, .]; {N, C, 1, 1}. Sixteen (or GROUP) running sums, then a tree.
kernel void sum_plane(IN(x), OUT(y), const real factor, const int plane) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1);
  GROUP_SCRATCH(scratch);
  global const real *x = AT(x, n) + (ulong)c * plane;
  lanes sum = (lanes)(R(0));
  FOR_ROW(i, plane) sum += lanes_load(x + i, plane - i);
  const real total = group_sum(sum, scratch);
  if (get_local_id(0) == 0) AT(y, n)[c] = factor * total;
}

// y[n, 0, i] = factor * sum over c of x[n, c, i]; {N, 1, H, W}. Work-item: one pixel.
kernel void sum_channels(IN(x), OUT(y), const real factor, const int channels, const int plane) {
  const int i = (int)get_global_id(0), n = (int)get_global_id(1);
  if (i >= plane) return;
  global const real *x = AT(x, n) + i;
  real sum = R(0);
  for (int c = 0; c < channels; ++c) sum += x[(ulong)c * plane];
  AT(y, n)[i] = factor * sum;
}

// y[0, i] = factor * sum over n of x[n, i]; {1, C, H, W}. Work-item: one element of an item.
kernel void sum_batch(IN(x), OUT(y), const real factor, const int batch, const int item) {
  const int i = (int)get_global_id(0);
  if (i >= item) return;
  real sum = R(0);
  for (int n = 0; n < batch; ++n) sum += AT(x, n)[i];
  AT(y, 0)[i] = factor * sum;
}
