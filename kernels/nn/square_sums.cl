// y[k] = sum of the squares of all numbers of tensor k, of up to eight tensors of unlike shapes: not finite where one of
// them is not, or is too large for its square. y: {1, K, 1, 1}.
#include "lib/lanes.clh"
#include "lib/slots.clh"

#define SLOT(k) IN(x##k), const int items##k, const int item##k
#define TAKE(k) \
  if (tensor == k) x = AT(x##k, 0), stride = x##k##_stride, items = items##k, item = item##k;

// Rows: part of a tensor. Part s of `parts` sums blocks s, s + parts, ... of `block` numbers, of all of the tensor's
// `items` of `item` numbers each, into partial[s][tensor].
kernel void square_sums(SLOTS(SLOT), OUT(partial), const int tensors, const int block) {
  const int tensor = (int)get_group_id(0), s = (int)get_group_id(1), parts = (int)get_num_groups(1);
  GROUP_SCRATCH(scratch);
  global const real *x = 0;
  int stride = 0, items = 0, item = 0;
  EACH_SLOT(TAKE)
  const int blocks = (item + block - 1) / block;
  lanes sum = (lanes)(R(0));
  for (int b = s; b < items * blocks; b += parts) {
    const int at = b % blocks * block, length = min(block, item - at);
    global const real *from = x + (ulong)(b / blocks) * (ulong)stride + at;
    FOR_ROW(i, length) {
      const lanes v = lanes_load(from + i, length - i);
      sum += v * v;
    }
  }
  const real total = group_sum(sum, scratch);
  if (get_local_id(0) == 0) AT(partial, 0)[s * tensors + tensor] = total;
}

// Work-item: a tensor; its parts are added in order.
kernel void square_totals(IN(partial), OUT(y), const int tensors, const int parts) {
  const int tensor = (int)get_global_id(0);
  if (tensor >= tensors) return;
  real sum = R(0);
  for (int s = 0; s < parts; ++s) sum += AT(partial, 0)[s * tensors + tensor];
  AT(y, 0)[tensor] = sum;
}
