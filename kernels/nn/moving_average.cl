// The average of parameters over the steps of training, a += (1 - keep) (p - a), which lies nearer to a minimum than any
// of them [Polyak and Juditsky 1992]. In its first steps, t counted from 1, it keeps (1 + t) / (10 + t) where that is
// less.
#include "lib/lanes.clh"
#include "lib/slots.clh"

#define SLOT(k) OUT(a##k), IN(p##k), SLOT_RANGE(k)
#define TAKE(k) a = AT(a##k, 0), p = AT(p##k, 0);

kernel void moving_average(SLOTS(SLOT), IN(step), const real keep, const int block) {
  global real *a = 0;
  global const real *p = 0;
  FIND_SLOT(TAKE)
  const real t = AT(step, 0)[0];
  const real grown = (R(1) + t) / (R(10) + t);
  const real share = R(1) - (grown > keep ? keep : grown);  // min() may answer a step that is no number with `keep`
  FOR_ROW(i, length) {
    const int left = length - i, at = first + i;
    const lanes average = lanes_load(a + at, left);
    lanes_store(fma((lanes)(share), lanes_load(p + at, left) - average, average), a + at, left);
  }
}
