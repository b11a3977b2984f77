// Joint bilateral upsampling (Kopf et al. 2007, ACM TOG 26(3), equation 3): maps {N, C, h, w} brought to the size of a
// guide {N, 3, H, W}; guide_low {N, 3, h, w} is the guide at the size of the maps.
//   y(p) = sum_q k(p, q) x(q) / sum_q k(p, q),  q over the 4 x 4 pixels around p's place in the small grid,
//   k = exp(-|p - q|^2 / 2) (exp(-|guide(p) - guide_low(q)|^2 / (2 sigma^2)) + 1/1024), distances in small pixels.
// x may be larger below and to the right (padding, rows of x_w): only its upper left h x w is used.
// The last term keeps the sum from vanishing where nothing looks alike.
#include "lib/real.clh"

kernel void joint_bilateral(IN(x), IN(guide_low), IN(guide), OUT(y), const int channels, const int x_h, const int x_w,
                            const int h, const int w, const int to_h, const int to_w, const real falloff) {
  const int p = (int)get_global_id(0);
  const int n = (int)get_global_id(1);
  if (p >= to_h * to_w) return;
  const int row = p / to_w;
  const real v = ((real)row + R(0.5)) * (real)h / (real)to_h - R(0.5);
  const real u = ((real)(p - row * to_w) + R(0.5)) * (real)w / (real)to_w - R(0.5);
  const int top = (int)floor(v) - 1, left = (int)floor(u) - 1;
  global const real *g = AT(guide, n) + p, *small = AT(guide_low, n), *map = AT(x, n);
  const int plane = h * w, to_plane = to_h * to_w;

  real k[16], sum = R(0);
  int at[16], from[16];
  for (int i = 0; i < 16; ++i) {
    const int qy = top + i / 4, qx = left + i % 4;
    const int cy = clamp(qy, 0, h - 1), cx = clamp(qx, 0, w - 1);
    at[i] = cy * w + cx, from[i] = cy * x_w + cx;
    const real dy = v - (real)qy, dx = u - (real)qx;
    real unlike = R(0);
    for (int c = 0; c < 3; ++c) {
      const real d = g[c * to_plane] - small[c * plane + at[i]];
      unlike += d * d;
    }
    k[i] = exp(R(-0.5) * (dy * dy + dx * dx)) * (exp(-unlike * falloff) + R(0.0009765625));
    sum += k[i];
  }
  for (int c = 0; c < channels; ++c) {
    real total = R(0);
    for (int i = 0; i < 16; ++i) total += k[i] * map[c * x_h * x_w + from[i]];
    AT(y, n)[c * to_plane + p] = total / sum;
  }
}
