// Losses between a predicted and a true map, averaged over a mask: L = factor sum_mask e / sum mask; 0 where the mask
// is empty. e per pixel, chosen by -D LOSS:
//   SQUARED  sum_c (a - b)^2
//   LOG      sum_c (ln(1 + a') - ln(1 + b))^2, a' = max(0, s a); a scale s per picture when SCALED is 1, else s = 1
//   COSINE   |1 - a . b|
// a, b: {N, C, H, W}; mask: {N, 1, H, W}, weights >= 0 (an averaged mask has fractions); pixels of weight 0 count for
// nothing whatever they hold; elsewhere a NaN makes the loss one. s: {N, 1, 1, 1}, detached.
#include "lib/lanes.clh"

#define SQUARED 0
#define LOG 1
#define COSINE 2
#ifndef LOSS
#define LOSS SQUARED
#endif

#if LOSS == LOG && SCALED
#define SCALE_OF(n) AT(scale, n)[0]
#else
#define SCALE_OF(n) R(1)
#endif

// ln(1 + max(0, q)) - ln(1 + t); a NaN stays one.
static inline lanes log_error(const lanes q, const lanes t) {
  return log1p(WHERE(q < R(0), (lanes)(R(0)), q)) - log1p(t);
}

// Sums of mask * e and of mask over one block of pixels: sums[row], sums[rows + row]; row = n * blocks + block.
// `scale` is read only when SCALED.
kernel void map_loss(IN(a), IN(b), IN(mask), IN(scale), OUT(sums), const int channels, const int plane,
                     const int block) {
  const int first = (int)get_group_id(0) * block, n = (int)get_group_id(1);
  const int length = min(block, plane - first);
  GROUP_SCRATCH(scratch);
  const real s = SCALE_OF(n);
  lanes total = (lanes)(R(0)), weight = (lanes)(R(0));
  FOR_ROW(i, length) {
    const int left = length - i;
    const lanes m = lanes_load(AT(mask, n) + first + i, left);
    lanes e = (lanes)(R(0));
    for (int c = 0; c < channels; ++c) {
      const lanes p = lanes_load(AT(a, n) + (ulong)c * plane + first + i, left);
      const lanes t = lanes_load(AT(b, n) + (ulong)c * plane + first + i, left);
#if LOSS == SQUARED
      e += (p - t) * (p - t);
#elif LOSS == LOG
      const lanes d = log_error(s * p, t);
      e += d * d;
#else
      e += p * t;
#endif
    }
#if LOSS == COSINE
    e = fabs(R(1) - e);
#endif
    total += WHERE(m == R(0), (lanes)(R(0)), m * e);
    weight += m;
  }
  const real sum = group_sum(total, scratch), count = group_sum(weight, scratch);
  if (get_local_id(0) == 0) {
    const int blocks = (int)get_num_groups(0), row = n * blocks + (int)get_group_id(0);
    AT(sums, 0)[row] = sum, AT(sums, 0)[blocks * (int)get_num_groups(1) + row] = count;
  }
}

// loss = factor * sum / count over all rows, and share = factor / count for the adjoint (0 for an empty mask). One
// work-group.
kernel void map_loss_total(IN(sums), OUT(loss), OUT(share), const real factor, const int rows) {
  GROUP_SCRATCH(scratch);
  lanes sums = (lanes)(R(0)), counts = (lanes)(R(0));
  FOR_ROW(i, rows) {
    sums += lanes_load(AT(sums, 0) + i, rows - i);
    counts += lanes_load(AT(sums, 0) + rows + i, rows - i);
  }
  const real sum = group_sum(sums, scratch), count = group_sum(counts, scratch);
  if (get_local_id(0) > 0) return;
  const real f = count == R(0) ? R(0) : factor / count;
  AT(share, 0)[0] = f;
  AT(loss, 0)[0] = f * sum;
}

// da = dloss * share * mask * de/da
kernel void map_loss_adjoint(IN(dloss), IN(a), IN(b), IN(mask), IN(scale), IN(share), OUT(da), const int channels,
                             const int plane, const int block) {
  const int first = (int)get_group_id(0) * block, n = (int)get_group_id(1);
  const int length = min(block, plane - first);
  const real s = SCALE_OF(n);
  const real weight = AT(dloss, 0)[0] * AT(share, 0)[0];
  FOR_ROW(i, length) {
    const int left = length - i;
    const lanes m = lanes_load(AT(mask, n) + first + i, left);
#if LOSS == COSINE
    lanes dot_product = (lanes)(R(0));
    for (int c = 0; c < channels; ++c)
      dot_product += lanes_load(AT(a, n) + (ulong)c * plane + first + i, left) *
                     lanes_load(AT(b, n) + (ulong)c * plane + first + i, left);
    const lanes beyond = dot_product - R(1);
    const lanes sign_of = WHERE(beyond == R(0), (lanes)(R(0)), beyond / fabs(beyond));
#endif
    for (int c = 0; c < channels; ++c) {
      const ulong at = (ulong)c * plane + first + i;
      const lanes p = lanes_load(AT(a, n) + at, left), t = lanes_load(AT(b, n) + at, left);
#if LOSS == SQUARED
      const lanes slope = R(2) * (p - t);
#elif LOSS == LOG
      const lanes q = s * p;
      const lanes slope = WHERE(q <= R(0), (lanes)(R(0)), R(2) * s * log_error(q, t) / (R(1) + q));
#else
      const lanes slope = sign_of * t;
#endif
      lanes_store(WHERE(m == R(0), (lanes)(R(0)), weight * m * slope), AT(da, n) + at, left);
    }
  }
}

// The scale that brings a to b in the least-squares sense over the mask, per picture:
//   s = clamp(sum a b / max(sum a^2, 1e-5), 0.001, 1000). Rows: one picture.
kernel void least_squares_scale(IN(a), IN(b), IN(mask), OUT(scale), const int channels, const int plane) {
  const int n = (int)get_group_id(0);
  GROUP_SCRATCH(scratch);
  lanes sum_ab = (lanes)(R(0)), sum_aa = (lanes)(R(0));
  for (int c = 0; c < channels; ++c)
    FOR_ROW(i, plane) {
      const lanes m = lanes_load(AT(mask, n) + i, plane - i);
      const lanes p = lanes_load(AT(a, n) + (ulong)c * plane + i, plane - i);
      const lanes t = lanes_load(AT(b, n) + (ulong)c * plane + i, plane - i);
      sum_ab += WHERE(m == R(0), (lanes)(R(0)), m * p * t);
      sum_aa += WHERE(m == R(0), (lanes)(R(0)), m * p * p);
    }
  const real ab = group_sum(sum_ab, scratch), aa = group_sum(sum_aa, scratch);
  const real s = ab / (aa < R(1e-5) ? R(1e-5) : aa);
  if (get_local_id(0) == 0) AT(scale, n)[0] = s < R(0.001) ? R(0.001) : s > R(1000) ? R(1000) : s;
}
