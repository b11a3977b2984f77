// The im2col matrix as a tensor, for convolution by a GEMM library; geometry as in nn/conv_geometry.clh. NCHW.
#include "nn/conv_geometry.clh"

// columns[k][p] = the source of one batch item under tap k at grid position p, zero outside, for the channels
// [first_channel, first_channel + g.channels). Work-item (p, k).
kernel void im2col(IN(source), SOURCE_MAP_PARAMS OUT(columns), const ConvGeometry g, const int n,
                   const int first_channel) {
  const int p = get_global_id(0), k = get_global_id(1), taps = g.taps_y * g.taps_x, positions = g.grid_h * g.grid_w;
  if (p >= positions || k >= g.channels * taps) return;
  const int at = source_element(g, first_channel * taps + k, p);
  AT(columns, 0)[(ulong)k * positions + p] =
      at >= 0 ? map1(SOURCE_MAP(first_channel + k / taps), AT(source, n)[at]) : R(0);
}

// The transpose, by gathering: source[n, first_channel + c, pixel] = sum over the taps (ascending) of the columns that
// read that pixel. Work-item (pixel, c).
kernel void col2im(IN(columns), OUT(source), const ConvGeometry g, const int n, const int first_channel) {
  const int pixel = get_global_id(0), c = get_global_id(1), taps = g.taps_y * g.taps_x;
  if (pixel >= g.source_plane || c >= g.channels) return;
  const int y = pixel / g.source_w - g.source_y, x = pixel % g.source_w - g.source_x;
  real sum = R(0);
  for (int ty = 0; ty < g.taps_y; ++ty)
    for (int tx = 0; tx < g.taps_x; ++tx) {
      const int gy = (y - ty) / g.source_step, gx = (x - tx) / g.source_step;
      if (y >= ty && x >= tx && gy * g.source_step == y - ty && gx * g.source_step == x - tx && gy < g.grid_h &&
          gx < g.grid_w)
        sum += AT(columns, 0)[((ulong)c * taps + ty * g.taps_x + tx) * g.grid_h * g.grid_w + gy * g.grid_w + gx];
    }
  AT(source, n)[(ulong)(first_channel + c) * g.source_plane + pixel] = sum;
}
