// The same numbers under another shape, where a view could not be taken. Element i of the whole tensor, counted over all
// items in NCHW order, stays element i; the batch size may change.
#include "lib/real.clh"

kernel void reshape_copy(IN(x), OUT(y), const int count, const int x_item, const int y_item) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  AT(y, i / y_item)[i % y_item] = AT(x, i / x_item)[i % x_item];
}
