// y[k] = sum of the squares of all numbers of tensor k, of up to eight tensors of unlike shapes: not finite where one of
// them is not, or is too large for its square. y: {1, K, 1, 1}. Rows: one tensor, its `items` of `item` numbers each.
#include "lib/lanes.clh"
#include "lib/slots.clh"

#define SLOT(k) IN(x##k), const int items##k, const int item##k
#define TAKE(k) \
  if (tensor == k) x = AT(x##k, 0), stride = x##k##_stride, items = items##k, item = item##k;

kernel void square_sums(SLOTS(SLOT), OUT(y)) {
  const int tensor = (int)get_group_id(0);
  GROUP_SCRATCH(scratch);
  global const real *x = 0;
  int stride = 0, items = 0, item = 0;
  EACH_SLOT(TAKE)
  lanes sum = (lanes)(R(0));
  for (int n = 0; n < items; ++n, x += stride) FOR_ROW(i, item) {
      const lanes v = lanes_load(x + i, item - i);
      sum += v * v;
    }
  const real total = group_sum(sum, scratch);
  if (get_local_id(0) == 0) AT(y, 0)[tensor] = total;
}
