// Joint bilateral up-sampling [Kopf et al. 2007]: a low-resolution map {N, C, h, w} brought to the size of a guide
// {N, G, H, W}, with weights from distances in the low-resolution grid and between the guide and its low-resolution
// version {N, G, h, w}:
//   y(p) = sum_q k(p, q) x(q) / sum_q k(p, q),  k = exp(-|p' - q|^2 / (2 s^2) - min(|I(p) - I'(q)|^2 / (2 r^2), 9.2))
// over the 5x5 pixels q around p' = (p + 0.5) h / H - 0.5, kept inside the `valid` top-left part of the low grid (the rest
// is padding). The cap keeps the spatial weights where nothing resembles p. Rows: one row of the output.
#include "lib/lanes.clh"

#define RADIUS 2
#define TAPS 5

#if GROUP == 1
typedef int16 lanes_int;
#define LANE_INDEX (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
#define TO_REAL(i) convert_real16(i)
#define TO_INT(v) convert_int16(v)
static inline lanes gather(global const real *p, const lanes_int at) {
  int index[16];
  real v[16];
  vstore16(at, 0, index);
  for (int k = 0; k < 16; ++k) v[k] = p[index[k]];
  return vload16(0, v);
}
#else
typedef int lanes_int;
#define LANE_INDEX 0
#define TO_REAL(i) ((real)(i))
#define TO_INT(v) ((int)(v))
static inline lanes gather(global const real *p, const lanes_int at) { return p[at]; }
#endif

// space = 1 / (2 s^2), range = 1 / (2 r^2).
kernel void bilateral_upsample(IN(x), IN(small_guide), IN(guide), OUT(y), const int channels, const int guides,
                               const int h, const int w, const int valid_h, const int valid_w, const int height,
                               const int width, const real space, const real range) {
  const int row = (int)get_group_id(0), n = (int)get_group_id(1);
  const real v = ((real)row + R(0.5)) * (real)valid_h / (real)height - R(0.5);
  const int centre_y = (int)floor(v + R(0.5));
  FOR_ROW(i, width) {
    const int left = width - i;
    const lanes_int column = min((lanes_int)(i) + LANE_INDEX, (lanes_int)(width - 1));
    const lanes u = (TO_REAL(column) + R(0.5)) * ((real)valid_w / (real)width) - R(0.5);
    const lanes_int centre_x = TO_INT(floor(u + R(0.5)));
    lanes weight[TAPS * TAPS];
    lanes_int at[TAPS];
    lanes total = (lanes)(R(0));
    for (int b = 0; b < TAPS; ++b) at[b] = clamp(centre_x + (b - RADIUS), (lanes_int)(0), (lanes_int)(valid_w - 1));
    for (int a = 0; a < TAPS; ++a) {
      const int qy = clamp(centre_y + a - RADIUS, 0, valid_h - 1);
      const real dy = v - (real)qy;
      for (int b = 0; b < TAPS; ++b) {
        const lanes dx = u - TO_REAL(at[b]);
        lanes difference = (lanes)(R(0));
        for (int g = 0; g < guides; ++g) {
          const lanes d = lanes_load(AT(guide, n) + ((ulong)g * height + row) * width + i, left) -
                          gather(AT(small_guide, n) + ((ulong)g * h + qy) * w, at[b]);
          difference += d * d;
        }
        const lanes k = exp(-space * (dy * dy + dx * dx) - fmin(range * difference, (lanes)(R(9.2))));
        weight[a * TAPS + b] = k;
        total += k;
      }
    }
    for (int c = 0; c < channels; ++c) {
      lanes sum = (lanes)(R(0));
      for (int a = 0; a < TAPS; ++a) {
        global const real *line = AT(x, n) + ((ulong)c * h + clamp(centre_y + a - RADIUS, 0, valid_h - 1)) * w;
        for (int b = 0; b < TAPS; ++b) sum += weight[a * TAPS + b] * gather(line, at[b]);
      }
      lanes_store(sum / total, AT(y, n) + ((ulong)c * height + row) * width + i, left);
    }
  }
}
