// The gradient of a convolution's bias {1, C, 1, 1} from dy {N, C, H, W}: gradient[c] = sum over n and pixels of dy[n,c].
// Rows: one channel (lib/lanes.clh). Lanes sum stretches of 256 numbers each, then the stretches, then a tree: rounding
// errors grow with the root of the count at worst.
#include "lib/lanes.clh"

#define STRETCH (256 * LANES * GROUP)

kernel void conv_bias_gradient(IN(dy), OUT(gradient), const int batch, const int plane) {
  const int c = (int)get_group_id(0);
  GROUP_SCRATCH(scratch);
  lanes sum = (lanes)(R(0));
  for (int n = 0; n < batch; ++n)
    for (int begin = 0; begin < plane; begin += STRETCH) {
      global const real *from = AT(dy, n) + (ulong)c * plane + begin;
      const int count = min(plane - begin, STRETCH);
      lanes part = (lanes)(R(0));
      FOR_ROW(i, count) part += lanes_load(from + i, count - i);
      sum += part;
    }
  const real total = group_sum(sum, scratch);
  if (get_local_id(0) == 0) AT(gradient, 0)[c] = total;
}
