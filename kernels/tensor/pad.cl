// Padding of planes by replication of the border: {N, C, H, W} -> {N, C, top + H + bottom, left + W + right}.
#include "lib/real.clh"

kernel void pad_replicate(IN(x), OUT(y), const int height, const int width, const int h, const int w, const int top,
                          const int left) {
  const int i = (int)get_global_id(0), c = (int)get_global_id(1), n = (int)get_global_id(2);
  if (i >= h * w) return;
  const int row = i / w, column = i - row * w;
  const int sy = clamp(row - top, 0, height - 1), sx = clamp(column - left, 0, width - 1);
  AT(y, n)[(ulong)c * h * w + i] = AT(x, n)[((ulong)c * height + sy) * width + sx];
}

// Each input sums the outputs that read it: one, or the run beside it on a border.
kernel void pad_replicate_adjoint(IN(dy), OUT(dx), const int height, const int width, const int h, const int w,
                                  const int top, const int left) {
  const int i = (int)get_global_id(0), c = (int)get_global_id(1), n = (int)get_global_id(2);
  if (i >= height * width) return;
  const int row = i / width, column = i - row * width;
  const int y0 = row == 0 ? 0 : row + top, y1 = row == height - 1 ? h - 1 : row + top;
  const int x0 = column == 0 ? 0 : column + left, x1 = column == width - 1 ? w - 1 : column + left;
  global const real *from = AT(dy, n) + (ulong)c * h * w;
  real sum = R(0);
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) sum += from[y * w + x];
  AT(dx, n)[(ulong)c * height * width + i] = sum;
}
