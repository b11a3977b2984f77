// 1 / x, or with ROOT 1 / sqrt(x), and their adjoints from the outputs: dx = -y^2 dy, -y^3 dy / 2. y may be x, dx may
// be dy. At 0 the result is infinite, and below it NaN with ROOT: who divides keeps x away from there.
#include "lib/lanes.clh"

static inline lanes value_of(const lanes x) {
#if ROOT
  return R(1) / sqrt(x);
#else
  return R(1) / x;
#endif
}

static inline lanes slope_of(const lanes y) {
#if ROOT
  return R(-0.5) * y * y * y;
#else
  return -y * y;
#endif
}

#define ROW                                       \
  const int first = (int)get_group_id(0) * block; \
  const int n = (int)get_group_id(1);             \
  const int length = min(block, item - first);

kernel void reciprocal(IN(x), OUT(y), const int item, const int block) {
  ROW
  global const real *x = AT(x, n) + first;
  global real *y = AT(y, n) + first;
  FOR_ROW(i, length) lanes_store(value_of(lanes_load(x + i, length - i)), y + i, length - i);
}

kernel void reciprocal_adjoint(IN(dy), IN(y), OUT(dx), const int item, const int block) {
  ROW
  global const real *y = AT(y, n) + first;
  global const real *dy = AT(dy, n) + first;
  global real *dx = AT(dx, n) + first;
  FOR_ROW(i, length) {
    const lanes slope = slope_of(lanes_load(y + i, length - i));
    lanes_store(slope * lanes_load(dy + i, length - i), dx + i, length - i);
  }
}
