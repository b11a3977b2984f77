// Adam [Kingma and Ba 2015, arXiv 1412.6980], in the form of PyTorch: with t counted from 1,
//   m = b1 m + (1 - b1) g;  v = b2 v + (1 - b2) g^2;  p -= lr / (1 - b1^t) * m / (sqrt(v) / sqrt(1 - b2^t) + epsilon)
#include "lib/lanes.clh"
#include "lib/slots.clh"

// schedule = (lr / (1 - b1^t), 1 / sqrt(1 - b2^t)). One work-item. 1 - b^t = -expm1(t ln b).
kernel void adam_schedule(IN(rate), IN(step), OUT(schedule), const real log_beta1, const real log_beta2) {
  if (get_global_id(0) > 0) return;
  const real t = AT(step, 0)[0];
  AT(schedule, 0)[0] = AT(rate, 0)[0] / -expm1(t * log_beta1);
  AT(schedule, 0)[1] = R(1) / sqrt(-expm1(t * log_beta2));
}

#define SLOT(k) IN(g##k), OUT(p##k), OUT(m##k), OUT(v##k), SLOT_RANGE(k)
#define TAKE(k) g = AT(g##k, 0), p = AT(p##k, 0), m = AT(m##k, 0), v = AT(v##k, 0);

// rest: 1 - beta, which a beta rounded to float has no digits for.
kernel void adam_update(SLOTS(SLOT), IN(schedule), const real beta1, const real beta2, const real rest1,
                        const real rest2, const real epsilon, const int block) {
  global const real *g = 0;
  global real *p = 0, *m = 0, *v = 0;
  FIND_SLOT(TAKE)
  const real rate = AT(schedule, 0)[0], unbias = AT(schedule, 0)[1];
  FOR_ROW(i, length) {
    const int left = length - i, at = first + i;
    const lanes d = lanes_load(g + at, left);
    const lanes first_moment = beta1 * lanes_load(m + at, left) + rest1 * d;
    const lanes second_moment = beta2 * lanes_load(v + at, left) + rest2 * d * d;
    const lanes moved = lanes_load(p + at, left) - rate * first_moment / (sqrt(second_moment) * unbias + epsilon);
    lanes_store(first_moment, m + at, left);
    lanes_store(second_moment, v + at, left);
    lanes_store(moved, p + at, left);
  }
}
