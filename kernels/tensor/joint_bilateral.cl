// Joint bilateral upsampling (Kopf et al. 2007, ACM TOG 26(3), equation 3): maps {N, C, h, w} brought to the size of a
// guide {N, 3, H, W}; guide_low {N, 3, h, w} is the guide at the size of the maps.
//   y(p) = sum_q k(p, q) x(q) / sum_q k(p, q),  q over the 4 x 4 pixels around p's place in the small grid,
//   k = exp(-|p - q|^2 / (2 reach^2)) (exp(-|guide(p) - guide_low(q)|^2 / (2 sigma^2)) + 1/1024), in small pixels.
// x may be larger below and to the right (padding, rows of x_w): only its upper left h x w is used.
// The last term keeps the sum from vanishing where nothing looks alike.
//
// A mean of two walls' normals is the normal of neither. joint_bilateral_mode answers with one of the values that it
// finds, and with those like it: a step of mean shift (Comaniciu and Meer 2002, IEEE TPAMI 24(5)) from the best of them,
//   g(q, r) = exp(-|x(q) - x(r)|^2 / (2 alike^2)),  m = argmax_q sum_r k(p, r) g(q, r), the first of those within 1e-5,
//   y(p) = sum_q k(p, q) g(q, m) x(q) / sum_q k(p, q) g(q, m).
#include "lib/real.clh"

#define TAPS 16
#define MODE_LEAD R(1.00001)  // by which a later value must have more: no rounding decides between two that have as much

/// The small pixel at or before pixel i of `to` along one axis: (i + 1/2) n / to - 1/2 rounded down, in whole numbers, for
/// a quotient that is rounded would choose neighbours by the device; `beyond` is the rest, in [0, 1).
static inline int place_in(const int i, const int n, const int to, real *beyond) {
  const long twice = (2 * (long)i + 1) * n + to;  // the place and a pixel more, of 2 to
  const int next = (int)(twice / (2 * (long)to));
  *beyond = (real)(twice - 2 * (long)to * next) / (real)(2 * to);
  return next - 1;
}

/// Places of p's 4 x 4 pixels in the small guide and in x, and their weights k. Falloffs are 1 / (2 sigma^2).
static void weigh(global const real *guide, global const real *small, const int p, const int x_w, const int h,
                  const int w, const int to_h, const int to_w, const real falloff, const real distance_falloff,
                  real k[TAPS], int from[TAPS]) {
  real above, before;  // p's place, in small pixels beyond the one that it lies at or behind
  const int top = place_in(p / to_w, h, to_h, &above) - 1, left = place_in(p % to_w, w, to_w, &before) - 1;
  const int plane = h * w, to_plane = to_h * to_w;
  for (int i = 0; i < TAPS; ++i) {
    const int qy = top + i / 4, qx = left + i % 4;
    const int cy = clamp(qy, 0, h - 1), cx = clamp(qx, 0, w - 1);
    from[i] = cy * x_w + cx;
    const real dy = above + (real)(1 - i / 4), dx = before + (real)(1 - i % 4);
    real unlike = R(0);
    for (int c = 0; c < 3; ++c) {
      const real d = guide[c * to_plane + p] - small[c * plane + cy * w + cx];
      unlike += d * d;
    }
    k[i] = exp(-distance_falloff * (dy * dy + dx * dx)) * (exp(-unlike * falloff) + R(0.0009765625));
  }
}

/// y(p) of every channel.
static void mean_of(global const real *map, global real *y, const int p, const int channels, const int x_plane,
                    const int to_plane, const real k[TAPS], const int from[TAPS]) {
  real sum = R(0);
  for (int i = 0; i < TAPS; ++i) sum += k[i];
  for (int c = 0; c < channels; ++c) {
    real total = R(0);
    for (int i = 0; i < TAPS; ++i) total += k[i] * map[c * x_plane + from[i]];
    y[c * to_plane + p] = total / sum;
  }
}

kernel void joint_bilateral(IN(x), IN(guide_low), IN(guide), OUT(y), const int channels, const int x_h, const int x_w,
                            const int h, const int w, const int to_h, const int to_w, const real falloff,
                            const real distance_falloff) {
  const int p = (int)get_global_id(0);
  const int n = (int)get_global_id(1);
  if (p >= to_h * to_w) return;
  real k[TAPS];
  int from[TAPS];
  weigh(AT(guide, n), AT(guide_low, n), p, x_w, h, w, to_h, to_w, falloff, distance_falloff, k, from);
  mean_of(AT(x, n), AT(y, n), p, channels, x_h * x_w, to_h * to_w, k, from);
}

kernel void joint_bilateral_mode(IN(x), IN(guide_low), IN(guide), OUT(y), const int channels, const int x_h,
                                 const int x_w, const int h, const int w, const int to_h, const int to_w,
                                 const real falloff, const real distance_falloff, const real alike_falloff) {
  const int p = (int)get_global_id(0);
  const int n = (int)get_global_id(1);
  if (p >= to_h * to_w) return;
  real k[TAPS];
  int from[TAPS];
  weigh(AT(guide, n), AT(guide_low, n), p, x_w, h, w, to_h, to_w, falloff, distance_falloff, k, from);
  global const real *map = AT(x, n);
  const int plane = x_h * x_w;
  real best[TAPS], most = R(-1);  // k g of the value that most agree with
  for (int q = 0; q < TAPS; ++q) {
    real agreed[TAPS], sum = R(0);
    for (int r = 0; r < TAPS; ++r) {
      real unlike = R(0);
      for (int c = 0; c < channels; ++c) {
        const real d = map[c * plane + from[q]] - map[c * plane + from[r]];
        unlike += d * d;
      }
      agreed[r] = k[r] * exp(-unlike * alike_falloff);
      sum += agreed[r];
    }
    if (sum <= most * MODE_LEAD) continue;
    most = sum;
    for (int r = 0; r < TAPS; ++r) best[r] = agreed[r];
  }
  mean_of(map, AT(y, n), p, channels, plane, to_h * to_w, best, from);
}
