// Two maps summed and laid out pixel by pixel, so that a ray finds what belongs to the pixel it hits side by side:
//   rows[y w + x][c] = surface[c][y][x] + features[c][cell of (x, y)].
// surface {1, C, h, w}; features {1, C, h', w'}, a coarser or finer grid laid over it: the cell that holds the pixel's
// centre (light/rescale_hits.cl). rows {1, 1, h w, C}. Work-item (x, y).
#include "light/cells.clh"

kernel void pixel_rows(IN(surface), IN(features), OUT(rows), const int channels, const int w, const int h,
                       const int cells_w, const int cells_h) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1);
  if (x >= w || y >= h) return;
  const ulong pixel = (ulong)y * (ulong)w + (ulong)x, plane = (ulong)w * (ulong)h;
  const ulong cell = (ulong)cell_of(y, h, cells_h) * (ulong)cells_w + (ulong)cell_of(x, w, cells_w);
  const ulong cells = (ulong)cells_w * (ulong)cells_h;
  global real *to = AT(rows, 0) + pixel * (ulong)channels;
  for (int c = 0; c < channels; ++c)
    to[c] = AT(surface, 0)[(ulong)c * plane + pixel] + AT(features, 0)[(ulong)c * cells + cell];
}
