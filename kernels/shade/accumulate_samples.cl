// The Monte Carlo mean of a pixel's samples and what is needed to judge it.
//
// x = weight * radiance (3 channels) of each ray {1, C, pixels, samples}, 0 where there is no direction (pdf 0).
// Columns {1, C, pixels, 1} that add up over chunks of samples: mean: sum of x over `count`, the number of all samples;
// squares: sum of (x - mean of this chunk)^2, in a second pass, so that nothing cancels; tally 4: sum of u, directions,
// samples dropped, hits. Of `first`, one plus the first sample dropped or 0, the first chunk's that has one counts.
// A sample with a NaN or Inf in any channel of x is dropped from all sums, and counted.
#include "lib/chunk.clh"
#include "lib/lanes.clh"

#if LANES == 16
#define LOAD(p) vload16(0, p)
#define HITS(p) convert_real16(-(vload16(0, p) >= 0))
#else
#define LOAD(p) (*(p))
#define HITS(p) ((real)(*(p) >= 0))
#endif

// 1 where all three channels of x are finite, else 0.
static inline lanes finite(const lanes x, const lanes y, const lanes z) {
  return WHERE((x - x) + (y - y) + (z - z) == R(0), R(1), R(0));
}

kernel void accumulate_samples(IN(weight), IN(radiance), IN(pdf),
#ifdef TRACED
                               IN(u), IN_INT(hit),
#endif
                               OUT(mean), OUT(squares), OUT(tally), OUT(first), CHUNK_ARGS, const real count) {
  const int p = (int)get_group_id(0);
  GROUP_SCRATCH(scratch);
  if (p >= pixels) return;
  const ulong row = RAY(p, 0);
  global const real *f = AT(weight, 0) + row, *l = AT(radiance, 0) + row, *density = AT(pdf, 0) + row;

  // Pass 1: sums, with Kahan's compensation in each lane.
  lanes sum[3], lost[3], drawn = R(0), kept = R(0), uncertain = R(0), hits = R(0);
  CHANNELS(c) sum[c] = lost[c] = R(0);
  FOR_ROW(i, samples) {
    lanes x[3];
    CHANNELS(c) x[c] = LOAD(f + c * RAY_PLANE + i) * LOAD(l + c * RAY_PLANE + i);
    const lanes is_ray = lanes_inside(WHERE(LOAD(density + i) == R(0), R(0), R(1)), samples - i);
    const lanes use = WHERE(is_ray > R(0), finite(x[0], x[1], x[2]), R(0));
    drawn += is_ray;
    kept += use;
    CHANNELS(c) {
      const lanes y = WHERE(use > R(0), x[c], R(0)) - lost[c];
      const lanes next = sum[c] + y;
      lost[c] = (next - sum[c]) - y;
      sum[c] = next;
    }
#ifdef TRACED
    uncertain += WHERE(use > R(0), LOAD(AT(u, 0) + row + i), R(0));
    hits += WHERE(use > R(0), HITS(AT(hit, 0) + row + i), R(0));
#endif
  }
  real total[3], scatter[3];
  CHANNELS(c) total[c] = group_sum(sum[c], scratch);
  const real directions = group_sum(drawn, scratch);
  const real dropped = directions - group_sum(kept, scratch);
  const real u_sum = group_sum(uncertain, scratch), hit_sum = group_sum(hits, scratch);

  // Pass 2: squares about the mean of this chunk.
  CHANNELS(c) sum[c] = R(0);
  FOR_ROW(i, samples) {
    lanes x[3];
    CHANNELS(c) x[c] = LOAD(f + c * RAY_PLANE + i) * LOAD(l + c * RAY_PLANE + i);
    const lanes is_ray = WHERE(LOAD(density + i) == R(0), R(0), R(1));
    const lanes use = WHERE(is_ray > R(0), finite(x[0], x[1], x[2]), R(0));
    CHANNELS(c) {
      const lanes e = WHERE(use > R(0), x[c], R(0)) - total[c] / (real)samples;
      sum[c] += lanes_inside(e * e, samples - i);
    }
  }
  CHANNELS(c) scatter[c] = group_sum(sum[c], scratch);

  real offender = R(0);
  if (dropped > R(0)) {  // as all items of the group see it
    int found = samples;
    for (int s = (int)get_local_id(0); found == samples && s < samples; s += GROUP) {
      real x = R(0);
      CHANNELS(c) x += f[c * RAY_PLANE + s] * l[c * RAY_PLANE + s];
      if (density[s] != R(0) && !isfinite(x)) found = s;
    }
    offender = (real)(first_sample + 1) + group_least((real)found, scratch);
  }
  if (get_local_id(0) > 0) return;
  CHANNELS(c) {
    AT(mean, 0)[c * pixel_capacity + p] = total[c] / count;
    AT(squares, 0)[c * pixel_capacity + p] = scatter[c];
  }
  const real tallies[4] = {u_sum, directions, dropped, hit_sum};
  for (int c = 0; c < 4; ++c) AT(tally, 0)[c * pixel_capacity + p] = tallies[c];
  AT(first, 0)[p] = offender;
}

// Adjoint of the mean: d weight = radiance g / count and d radiance = weight g / count for the samples that it keeps.
// g {1, 3, pixels, 1}. squares and tally are statistics, without gradients.
kernel void accumulate_samples_adjoint(IN(weight), IN(radiance), IN(pdf), IN(g), OUT(d_weight), OUT(d_radiance),
                                       CHUNK_ARGS, const real count) {
  const int s = (int)get_global_id(0);
  const int p = (int)get_global_id(1);
  if (s >= sample_capacity || p >= pixels) return;
  const ulong ray = RAY(p, s);
  global const real *f = AT(weight, 0) + ray, *l = AT(radiance, 0) + ray;
  int kept = s < samples && AT(pdf, 0)[ray] != R(0);
  CHANNELS(c) kept = kept && isfinite(f[c * RAY_PLANE] * l[c * RAY_PLANE]);
  CHANNELS(c) {
    const real share = AT(g, 0)[c * pixel_capacity + p] / count;
    AT(d_weight, 0)[c * RAY_PLANE + ray] = kept ? share * l[c * RAY_PLANE] : R(0);
    AT(d_radiance, 0)[c * RAY_PLANE + ray] = kept ? share * f[c * RAY_PLANE] : R(0);
  }
}

// Whole maps: the standard error of a mean of `count` samples, sqrt(squares / freedom / count), freedom = count less
// the number of chunks of samples; and the mean u over the directions drawn. squares {n, 3}, tally {n, 4}.
kernel void finish_samples(IN(squares), IN(tally), OUT(standard_error), OUT(uncertainty), const int plane,
                           const real count, const real freedom) {
  const int pixel = (int)get_global_id(0);
  const int n = (int)get_global_id(1);
  if (pixel >= plane) return;
  CHANNELS(c) {
    const int at = c * plane + pixel;
    AT(standard_error, n)[at] = sqrt(AT(squares, n)[at] / freedom / count);
  }
  const real used = AT(tally, n)[plane + pixel] - AT(tally, n)[2 * plane + pixel];
  AT(uncertainty, n)[pixel] = used > R(0) ? AT(tally, n)[pixel] / used : R(0);
}
