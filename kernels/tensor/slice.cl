// A run of channels of a tensor {N, C, H, W}, where a view could not be taken, and its adjoint.
#include "lib/lanes.clh"

// y = the `count` elements of each item that begin at element `at`.
kernel void slice_take(IN(x), OUT(y), const int at, const int count, const int block) {
  const int first = (int)get_group_id(0) * block;
  const int n = (int)get_group_id(1);
  const int length = min(block, count - first);
  global const real *from = AT(x, n) + at + first;
  global real *to = AT(y, n) + first;
  FOR_ROW(i, length) lanes_store(lanes_load(from + i, length - i), to + i, length - i);
}

// dx = dy at its place in each item of `item` elements, zero elsewhere.
kernel void slice_adjoint(IN(dy), OUT(dx), const int at, const int count, const int item, const int block) {
  const int first = (int)get_group_id(0) * block;
  const int n = (int)get_group_id(1);
  const int length = min(block, item - first);
  global const real *from = AT(dy, n);
  global real *to = AT(dx, n);
  for (int k = (int)get_local_id(0); k < length; k += GROUP) {
    const int i = first + k;
    to[i] = i >= at && i < at + count ? from[i - at] : R(0);
  }
}
