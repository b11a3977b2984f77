// Padding of planes by replication of the border: {N, C, H, W} -> {N, C, top + H + bottom, left + W + right}.
// Rows of a work-group: the rows of one plane.
#include "lib/lanes.clh"

#define FOR_LANES(i, n) for (int i = (int)get_local_id(0); i < (n); i += GROUP)

kernel void pad_replicate(IN(x), OUT(y), const int height, const int width, const int h, const int w, const int top,
                          const int left) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1);
  for (int j = 0; j < h; ++j) {
    global const real *from = AT(x, n) + ((ulong)c * height + clamp(j - top, 0, height - 1)) * width;
    global real *to = AT(y, n) + ((ulong)c * h + j) * w;
    FOR_LANES(i, left) to[i] = from[0];
    FOR_ROW(i, width) lanes_store(lanes_load(from + i, width - i), to + left + i, width - i);
    FOR_LANES(i, w - width - left) to[left + width + i] = from[width - 1];
  }
}

// Each input sums the outputs that read it: one, or the run beside it on a border.
kernel void pad_replicate_adjoint(IN(dy), OUT(dx), const int height, const int width, const int h, const int w,
                                  const int top, const int left) {
  const int c = (int)get_group_id(0), n = (int)get_group_id(1);
  for (int j = 0; j < height; ++j) {
    const int y0 = j == 0 ? 0 : j + top, y1 = j == height - 1 ? h - 1 : j + top;
    global const real *from = AT(dy, n) + (ulong)c * h * w;
    global real *to = AT(dx, n) + ((ulong)c * height + j) * width;
    FOR_ROW(i, width) {
      lanes sum = (lanes)(R(0));
      for (int y = y0; y <= y1; ++y) sum += lanes_load(from + y * w + left + i, width - i);
      lanes_store(sum, to + i, width - i);
    }
    // The ends again, with what was padded beside them.
#if GROUP > 1
    barrier(CLK_GLOBAL_MEM_FENCE);
#endif
    FOR_LANES(side, 2) {
      const int i = side == 0 ? 0 : width - 1;
      if (side == 1 && width == 1) break;
      const int x0 = i == 0 ? 0 : i + left, x1 = i == width - 1 ? w - 1 : i + left;
      real sum = R(0);
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) sum += from[y * w + x];
      to[i] = sum;
    }
  }
}
