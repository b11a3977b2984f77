// Concatenation along channels, where its inputs could not be written in place: copies one part.
// part: {N, C, H, W} with `count` = C H W; whole: a bigger item; `at` is where the part begins in each item.
#include "lib/lanes.clh"

kernel void concat_part(IN(part), OUT(whole), const int at, const int count, const int block) {
  const int first = (int)get_group_id(0) * block;
  const int n = (int)get_group_id(1);
  const int length = min(block, count - first);
  global const real *from = AT(part, n) + first;
  global real *to = AT(whole, n) + at + first;
  FOR_ROW(i, length) lanes_store(lanes_load(from + i, length - i), to + i, length - i);
}
