// Sums and products of two tensors, the second one broadcast: y[n,c,i] = a[n,c,i] (+ weight | *) b[n',c',i'], where n', c', i'
// are n, c, i or 0 as b has that axis. Rows are channels, or whole items when both have one shape (then channels = 1).
#include "lib/lanes.clh"

#define ROW                                                                    \
  const int first = (int)get_group_id(0) * block;                              \
  const int c = (int)get_group_id(1), n = (int)get_group_id(2);                \
  const int length = min(block, plane - first);

// b_c: elements between channels of b, 0 when it has one; b_n, b_i: 1 when b has that axis.
#define B_ROW global const real *b = AT(b, b_n ? n : 0) + (ulong)c * b_c + (b_i ? first : 0);
#define B(i) (b_i ? lanes_load(b + i, length - i) : (lanes)(b[0]))

// y = a + weight * b
kernel void add_scaled(IN(a), IN(b), OUT(y), const real weight, const int plane, const int b_n, const int b_c,
                       const int b_i, const int block) {
  ROW B_ROW
  global const real *a = AT(a, n) + (ulong)c * plane + first;
  global real *y = AT(y, n) + (ulong)c * plane + first;
  FOR_ROW(i, length) lanes_store(lanes_load(a + i, length - i) + weight * B(i), y + i, length - i);
}

// y = a * b
kernel void multiply(IN(a), IN(b), OUT(y), const int plane, const int b_n, const int b_c, const int b_i,
                     const int block) {
  ROW B_ROW
  global const real *a = AT(a, n) + (ulong)c * plane + first;
  global real *y = AT(y, n) + (ulong)c * plane + first;
  FOR_ROW(i, length) lanes_store(lanes_load(a + i, length - i) * B(i), y + i, length - i);
}

// y = factor * b, broadcast: the adjoint of a sum
kernel void expand(IN(b), OUT(y), const real factor, const int plane, const int b_n, const int b_c, const int b_i,
                   const int block) {
  ROW B_ROW
  global real *y = AT(y, n) + (ulong)c * plane + first;
  FOR_ROW(i, length) lanes_store(factor * B(i), y + i, length - i);
}

// y = factor * a + offset
kernel void affine(IN(a), OUT(y), const real factor, const real offset, const int plane, const int block) {
  ROW
  global const real *a = AT(a, n) + (ulong)c * plane + first;
  global real *y = AT(y, n) + (ulong)c * plane + first;
  FOR_ROW(i, length) lanes_store(factor * lanes_load(a + i, length - i) + offset, y + i, length - i);
}
