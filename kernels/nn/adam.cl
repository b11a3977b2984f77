// Adam [Kingma and Ba 2015, arXiv 1412.6980], in the form of PyTorch: with t counted from 1,
//   m = b1 m + (1 - b1) g;  v = b2 v + (1 - b2) g^2;  p -= lr / (1 - b1^t) * m / (sqrt(v) / sqrt(1 - b2^t) + epsilon)
#include "lib/lanes.clh"

// schedule = (lr / (1 - b1^t), 1 / sqrt(1 - b2^t)). One work-item. 1 - b^t = -expm1(t ln b).
kernel void adam_schedule(IN(rate), IN(step), OUT(schedule), const real log_beta1, const real log_beta2) {
  if (get_global_id(0) > 0) return;
  const real t = AT(step, 0)[0];
  AT(schedule, 0)[0] = AT(rate, 0)[0] / -expm1(t * log_beta1);
  AT(schedule, 0)[1] = R(1) / sqrt(-expm1(t * log_beta2));
}

// Rows: blocks of each item of `item` elements.
kernel void adam_update(IN(g), OUT(p), OUT(m), OUT(v), IN(schedule), const real beta1, const real beta2,
                        const real epsilon, const int item, const int block) {
  const int first = (int)get_group_id(0) * block, n = (int)get_group_id(1);
  const int length = min(block, item - first);
  const real rate = AT(schedule, 0)[0], unbias = AT(schedule, 0)[1];
  FOR_ROW(i, length) {
    const int left = length - i, at = first + i;
    const lanes d = lanes_load(AT(g, n) + at, left);
    const lanes first_moment = beta1 * lanes_load(AT(m, n) + at, left) + (R(1) - beta1) * d;
    const lanes second_moment = beta2 * lanes_load(AT(v, n) + at, left) + (R(1) - beta2) * d * d;
    const lanes moved = lanes_load(AT(p, n) + at, left) - rate * first_moment / (sqrt(second_moment) * unbias + epsilon);
    lanes_store(first_moment, AT(m, n) + at, left);
    lanes_store(second_moment, AT(v, n) + at, left);
    lanes_store(moved, AT(p, n) + at, left);
  }
}
