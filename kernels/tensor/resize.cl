// Resampling of planes: {N, C, H, W} -> {N, C, h, w}. Rows of a work-group: `rows` rows of one plane.
// Bilinear with align_corners: output i reads the input at i (in - 1) / (out - 1), computed in integers, so that no rounding
// decides between neighbours. A size of 1 reads input 0.
#include "lib/lanes.clh"

// Where output i of `outs` falls among `ins` inputs: between *at and *at + 1, at `fraction` of the way.
static inline real position(const int i, const int ins, const int outs, int *at) {
  const int steps = max(outs - 1, 1);
  const int numerator = i * (ins - 1);
  *at = min(numerator / steps, max(ins - 2, 0));
  return ins > 1 ? (real)(numerator - *at * steps) / (real)steps : R(0);
}

#define FOR_LANES(x, w) for (int x = (int)get_local_id(0); x < (w); x += GROUP)

// line, fractions, ats: local memory of W, w, w numbers.
kernel void resize_bilinear(IN(x), OUT(y), const int height, const int width, const int h, const int w, const int rows,
                            local real *line, local real *fractions, local int *ats) {
  const int c = (int)get_group_id(1), n = (int)get_group_id(2);
  global const real *from = AT(x, n) + (ulong)c * height * width;
  global real *to = AT(y, n) + (ulong)c * h * w;
  FOR_LANES(i, w) {
    int at;
    fractions[i] = position(i, width, w, &at);
    ats[i] = at;
  }
  const int first = (int)get_group_id(0) * rows, last = min(first + rows, h);
  const int right = width > 1 ? 1 : 0, below = height > 1 ? width : 0;
  for (int j = first; j < last; ++j) {
    int above;
    const real f = position(j, height, h, &above);
    global const real *a = from + above * width;
    GROUP_BARRIER;
    FOR_LANES(i, width) line[i] = a[i] + f * (a[i + below] - a[i]);
    GROUP_BARRIER;
    FOR_LANES(i, w) {
      const real left = line[ats[i]];
      to[j * w + i] = left + fractions[i] * (line[ats[i] + right] - left);
    }
  }
}

// The outputs that read input i with weight above 0 begin at the least o with o (ins - 1) > (i - 1) (outs - 1).
static inline int first_reader(const int i, const int ins, const int outs) {
  if (i <= 0 || ins == 1) return 0;
  return min((i - 1) * (outs - 1) / (ins - 1) + 1, outs - 1);
}

// Weight of input i in output o.
static inline real reader_weight(const int o, const int i, const int ins, const int outs) {
  if (o >= outs) return R(0);
  int at;
  const real f = position(o, ins, outs, &at);
  return at == i ? R(1) - f : at + 1 == i ? f : R(0);
}

// dx: each input gathers from its readers, at most `most_y` x `most_x` of them. line, weights, firsts: local memory of w,
// most_x W, W numbers.
kernel void resize_bilinear_adjoint(IN(dy), OUT(dx), const int height, const int width, const int h, const int w,
                                    const int most_y, const int most_x, const int rows, local real *line,
                                    local real *weights, local int *firsts) {
  const int c = (int)get_group_id(1), n = (int)get_group_id(2);
  global const real *from = AT(dy, n) + (ulong)c * h * w;
  global real *to = AT(dx, n) + (ulong)c * height * width;
  FOR_LANES(i, width) {
    const int reader = first_reader(i, width, w);
    firsts[i] = reader;
    for (int k = 0; k < most_x; ++k) weights[k * width + i] = reader_weight(reader + k, i, width, w);
  }
  const int first = (int)get_group_id(0) * rows, last = min(first + rows, height);
  for (int j = first; j < last; ++j) {
    const int reader = first_reader(j, height, h);
    GROUP_BARRIER;
    FOR_LANES(i, w) line[i] = R(0);
    for (int k = 0; k < most_y; ++k) {
      const real weight = reader_weight(reader + k, j, height, h);
      if (weight == R(0)) continue;
      global const real *row = from + (reader + k) * w;
      FOR_LANES(i, w) line[i] += weight * row[i];
    }
    GROUP_BARRIER;
    global real *out = to + j * width;
    FOR_LANES(i, width) {
      real sum = R(0);
      for (int k = 0; k < most_x; ++k) sum += weights[k * width + i] * line[min(firsts[i] + k, w - 1)];
      out[i] = sum;
    }
  }
}

// y = mean of the input over the output pixel's box [i H / h, (i + 1) H / h), parts of pixels counted as such.
kernel void resize_area(IN(x), OUT(y), const int height, const int width, const int h, const int w) {
  const int i = (int)get_global_id(0), c = (int)get_global_id(1), n = (int)get_global_id(2);
  if (i >= h * w) return;
  const int row = i / w, column = i - row * w;
  global const real *from = AT(x, n) + (ulong)c * height * width;
  const real top = (real)(row * height) / (real)h, bottom = (real)((row + 1) * height) / (real)h;
  const real left = (real)(column * width) / (real)w, right = (real)((column + 1) * width) / (real)w;
  // First and last input row and column of the box, in integers.
  const int y0 = row * height / h, y1 = ((row + 1) * height + h - 1) / h;
  const int x0 = column * width / w, x1 = ((column + 1) * width + w - 1) / w;
  real sum = R(0);
  for (int sy = y0; sy < y1; ++sy) {
    real line = R(0);
    for (int sx = x0; sx < x1; ++sx)
      line += (fmin(right, (real)(sx + 1)) - fmax(left, (real)sx)) * from[sy * width + sx];
    sum += (fmin(bottom, (real)(sy + 1)) - fmax(top, (real)sy)) * line;
  }
  AT(y, n)[(ulong)c * h * w + i] = sum / ((bottom - top) * (right - left));
}

// y = the input pixel that holds the output pixel's centre.
kernel void resize_nearest(IN(x), OUT(y), const int height, const int width, const int h, const int w) {
  const int i = (int)get_global_id(0), c = (int)get_global_id(1), n = (int)get_global_id(2);
  if (i >= h * w) return;
  const int row = i / w, column = i - row * w;
  const int sy = (2 * row + 1) * height / (2 * h), sx = (2 * column + 1) * width / (2 * w);
  AT(y, n)[(ulong)c * h * w + i] = AT(x, n)[((ulong)c * height + sy) * width + sx];
}
