// Group normalisation [Wu and He 2018, arXiv 1803.08494], then ReLU when RELU is 1:
//   y = gamma_c (x - mean) s + beta_c,  s = 1 / sqrt(variance + epsilon),
// mean and biased variance over the group's channels and plane, for each picture. x, y: {N, C, H, W}; gamma, beta:
// {1, C, 1, 1}; moments: {N, G, 1, 2} = (mean, s). Rows: one group of one picture, `channels` * plane numbers that lie
// side by side and stay in the cache between passes.
#include "lib/lanes.clh"

kernel void group_normalise(IN(x), IN(gamma), IN(beta), OUT(y), OUT(moments), const real epsilon, const int channels,
                            const int plane) {
  const int group = (int)get_group_id(0), n = (int)get_group_id(1);
  GROUP_SCRATCH(scratch);
  const int count = channels * plane;
  const real share = R(1) / (real)count;
  global const real *x = AT(x, n) + (ulong)group * count;
  // What differs from the first number: the mean of numbers that are all alike is that number.
  const real first = x[0];
  lanes sum = (lanes)(R(0));
  FOR_ROW(i, count) sum += lanes_inside(lanes_load(x + i, count - i) - first, count - i);
  const real mean = first + share * group_sum(sum, scratch);
  lanes squares = (lanes)(R(0));
  FOR_ROW(i, count) {
    const lanes d = lanes_inside(lanes_load(x + i, count - i) - mean, count - i);
    squares += d * d;
  }
  const real s = R(1) / sqrt(share * group_sum(squares, scratch) + epsilon);
  for (int k = 0; k < channels; ++k) {
    const int c = group * channels + k;
    const real slope = AT(gamma, 0)[c] * s, shift = AT(beta, 0)[c];
    global const real *from = x + k * plane;
    global real *to = AT(y, n) + (ulong)c * plane;
    FOR_ROW(i, plane) {
      lanes v = slope * (lanes_load(from + i, plane - i) - mean) + shift;
#if RELU
      v = WHERE(v < R(0), (lanes)(R(0)), v);
#endif
      lanes_store(v, to + i, plane - i);
    }
  }
  if (get_local_id(0) == 0) {
    global real *m = AT(moments, n) + 2 * group;
    m[0] = mean, m[1] = s;
  }
}

// With g = dy where the ReLU was open, t = (x - mean) s, and sums over the group of M numbers:
//   dx = s (gamma g - sum(gamma g) / M - t sum(gamma g t) / M)
// dgamma, dbeta: {N, C, 1, 1}, the sums over the plane of g t and g; the batch is summed afterwards. dx may be dy.
kernel void group_normalise_adjoint(IN(dy), IN(x), IN(gamma), IN(beta), IN(moments), OUT(dx), OUT(dgamma), OUT(dbeta),
                                    const int channels, const int plane) {
  const int group = (int)get_group_id(0), n = (int)get_group_id(1);
  GROUP_SCRATCH(scratch);
  const real share = R(1) / ((real)channels * (real)plane);
  const real mean = AT(moments, n)[2 * group], s = AT(moments, n)[2 * group + 1];
  real sum_g = R(0), sum_gt = R(0);
  for (int k = 0; k < channels; ++k) {
    const int c = group * channels + k;
    const real weight = AT(gamma, 0)[c], shift = AT(beta, 0)[c];
    global const real *from = AT(dy, n) + (ulong)c * plane;
    global const real *p = AT(x, n) + (ulong)c * plane;
    lanes part_g = (lanes)(R(0)), part_gt = (lanes)(R(0));
    FOR_ROW(i, plane) {
      const lanes t = (lanes_load(p + i, plane - i) - mean) * s;
      lanes g = lanes_load(from + i, plane - i);
#if RELU
      g = WHERE(weight * t + shift > R(0), g, (lanes)(R(0)));
#endif
      part_g += g;
      part_gt += g * t;
    }
    const real channel_g = group_sum(part_g, scratch), channel_gt = group_sum(part_gt, scratch);
    sum_g += weight * channel_g, sum_gt += weight * channel_gt;
    if (get_local_id(0) == 0) AT(dgamma, n)[c] = channel_gt, AT(dbeta, n)[c] = channel_g;
  }
  for (int k = 0; k < channels; ++k) {
    const int c = group * channels + k;
    const real weight = AT(gamma, 0)[c], shift = AT(beta, 0)[c];
    global const real *from = AT(dy, n) + (ulong)c * plane;
    global const real *p = AT(x, n) + (ulong)c * plane;
    global real *to = AT(dx, n) + (ulong)c * plane;
    FOR_ROW(i, plane) {
      const lanes t = (lanes_load(p + i, plane - i) - mean) * s;
      lanes g = lanes_load(from + i, plane - i);
#if RELU
      g = WHERE(weight * t + shift > R(0), g, (lanes)(R(0)));
#endif
      lanes_store(s * (weight * g - share * (sum_g + t * sum_gt)), to + i, plane - i);
    }
  }
}
