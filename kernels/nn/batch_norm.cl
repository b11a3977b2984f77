// Batch normalisation [Ioffe and Szegedy 2015, arXiv 1502.03167], split in two so that the moments of a feature are
// computed once and shared by every layer that normalises it (a dense block normalises each feature many times):
//   moments:   mean and biased variance of each channel over batch and plane
//   normalise: y = gamma (x - mean) / sqrt(variance + epsilon) + beta, then ReLU when RELU is 1
// moments: {1, C, 1, 2} = (mean, variance) of each channel; gamma, beta: {1, C, 1, 1}; x, y: {N, C, H, W}.
// With ADD an adjoint adds a gradient that others brought to dx.
#include "lib/lanes.clh"

#ifdef ADD
#define SUM_PARAM IN(sum),
#define SUM_ROW(n, at) global const real *sum = AT(sum, n) + (at);
#define PLUS_SUM(i, left) +lanes_load(sum + (i), left)
#else
#define SUM_PARAM
#define SUM_ROW(n, at)
#define PLUS_SUM(i, left)
#endif

// Rows: one channel. Two passes over it (it lies in the cache the second time): no cancellation. The first sums what
// differs from the channel's first number, so that the mean of numbers that are all alike is that number.
kernel void channel_moments(IN(x), OUT(moments), const int batch, const int plane) {
  const int c = (int)get_group_id(0);
  GROUP_SCRATCH(scratch);
  const real share = R(1) / ((real)batch * (real)plane), first = AT(x, 0)[(ulong)c * plane];
  lanes sum = (lanes)(R(0));
  for (int n = 0; n < batch; ++n) {
    global const real *p = AT(x, n) + (ulong)c * plane;
    FOR_ROW(i, plane) sum += lanes_inside(lanes_load(p + i, plane - i) - first, plane - i);
  }
  const real mean = first + share * group_sum(sum, scratch);
  lanes squares = (lanes)(R(0));
  for (int n = 0; n < batch; ++n) {
    global const real *p = AT(x, n) + (ulong)c * plane;
    FOR_ROW(i, plane) {
      const lanes d = lanes_inside(lanes_load(p + i, plane - i) - mean, plane - i);
      squares += d * d;
    }
  }
  const real variance = share * group_sum(squares, scratch);
  if (get_local_id(0) == 0) {
    global real *m = AT(moments, 0) + 2 * c;
    m[0] = mean, m[1] = variance;
  }
}

// dx = (dmean + 2 dvariance (x - mean)) / (N H W)
kernel void channel_moments_adjoint(IN(dmoments), IN(x), IN(moments), SUM_PARAM OUT(dx), const int batch, const int plane,
                                    const int block) {
  const int first = (int)get_group_id(0) * block;
  const int c = (int)get_group_id(1), n = (int)get_group_id(2);
  const int length = min(block, plane - first);
  const real share = R(1) / ((real)batch * (real)plane);
  const real mean = AT(moments, 0)[2 * c];
  const real slope = R(2) * share * AT(dmoments, 0)[2 * c + 1];
  const real constant_part = share * AT(dmoments, 0)[2 * c];
  global const real *p = AT(x, n) + (ulong)c * plane + first;
  global real *to = AT(dx, n) + (ulong)c * plane + first;
  SUM_ROW(n, (ulong)c * plane + first)
  FOR_ROW(i, length)
    lanes_store(slope * (lanes_load(p + i, length - i) - mean) + constant_part PLUS_SUM(i, length - i), to + i, length - i);
}

kernel void normalise_channels(IN(x), IN(moments), IN(gamma), IN(beta), OUT(y), const real epsilon, const int plane,
                               const int block) {
  const int first = (int)get_group_id(0) * block;
  const int c = (int)get_group_id(1), n = (int)get_group_id(2);
  const int length = min(block, plane - first);
  const real mean = AT(moments, 0)[2 * c];
  const real slope = AT(gamma, 0)[c] / sqrt(AT(moments, 0)[2 * c + 1] + epsilon);
  const real shift = AT(beta, 0)[c];
  global const real *p = AT(x, n) + (ulong)c * plane + first;
  global real *to = AT(y, n) + (ulong)c * plane + first;
  FOR_ROW(i, length) {
    lanes v = slope * (lanes_load(p + i, length - i) - mean) + shift;
#if RELU
    v = WHERE(v < R(0), (lanes)(R(0)), v);
#endif
    lanes_store(v, to + i, length - i);
  }
}

// One pass over dy and x gives, per channel, with g = dy where the ReLU was open, t = x - mean, s = 1/sqrt(var + eps):
//   dx = gamma s g;  dbeta = sum g;  dgamma = s sum g t;  dmean = -gamma s dbeta;  dvar = -gamma s^3 / 2 sum g t
// The moments' own dependence on x is theirs to add (channel_moments_adjoint), once per feature instead of once per
// layer. dmoments: {1, C, 1, 2}. Rows: one channel. dx may be dy.
kernel void normalise_channels_adjoint(IN(dy), IN(x), IN(moments), IN(gamma), IN(beta), SUM_PARAM OUT(dx), OUT(dgamma),
                                       OUT(dbeta), OUT(dmoments), const real epsilon, const int batch,
                                       const int plane) {
  const int c = (int)get_group_id(0);
  GROUP_SCRATCH(scratch);
  const real mean = AT(moments, 0)[2 * c];
  const real s = R(1) / sqrt(AT(moments, 0)[2 * c + 1] + epsilon);
  const real slope = AT(gamma, 0)[c] * s;
  const real shift = AT(beta, 0)[c];
  lanes sum_g = (lanes)(R(0)), sum_gt = (lanes)(R(0));
  for (int n = 0; n < batch; ++n) {
    global const real *from = AT(dy, n) + (ulong)c * plane;
    global const real *p = AT(x, n) + (ulong)c * plane;
    global real *to = AT(dx, n) + (ulong)c * plane;
    SUM_ROW(n, (ulong)c * plane)
    FOR_ROW(i, plane) {
      const int left = plane - i;
      const lanes t = lanes_load(p + i, left) - mean;
      lanes g = lanes_load(from + i, left);
#if RELU
      g = WHERE(slope * t + shift > R(0), g, (lanes)(R(0)));
#endif
      sum_g += g;
      sum_gt += g * t;
      lanes_store(slope * g PLUS_SUM(i, left), to + i, left);
    }
  }
  const real g = group_sum(sum_g, scratch), gt = group_sum(sum_gt, scratch);
  if (get_local_id(0) == 0) {
    AT(dgamma, 0)[c] = s * gt, AT(dbeta, 0)[c] = g;
    AT(dmoments, 0)[2 * c] = -slope * g, AT(dmoments, 0)[2 * c + 1] = R(-0.5) * slope * s * s * gt;
  }
}

// running = (1 - momentum) running + momentum batch, with the unbiased variance, as PyTorch keeps it: unbias = count /
// (count - 1).
kernel void update_running(IN(moments), OUT(running_mean), OUT(running_variance), const real momentum,
                           const real unbias, const int channels) {
  const int c = (int)get_global_id(0);
  if (c >= channels) return;
  global const real *m = AT(moments, 0) + 2 * c;
  global real *mean = AT(running_mean, 0) + c;
  global real *variance = AT(running_variance, 0) + c;
  *mean = (R(1) - momentum) * *mean + momentum * m[0];
  *variance = (R(1) - momentum) * *variance + momentum * unbias * m[1];
}

// moments = (running mean, running variance), for inference. Work-item: one channel.
kernel void running_moments(IN(running_mean), IN(running_variance), OUT(moments), const int channels) {
  const int c = (int)get_global_id(0);
  if (c >= channels) return;
  AT(moments, 0)[2 * c] = AT(running_mean, 0)[c], AT(moments, 0)[2 * c + 1] = AT(running_variance, 0)[c];
}
