// Hits of a picture as cells of a coarser or finer grid laid over it: the cell that holds the hit pixel's centre,
// floor((x + 0.5) w' / w), rows alike; misses stay -1. hit, y Int {1, 1, pixels, samples} (kernels/lib/chunk.clh).
#include "lib/chunk.clh"
#include "light/cells.clh"

kernel void rescale_hits(IN_INT(hit), OUT_INT(y), CHUNK_ARGS, const int from_w, const int from_h, const int to_w,
                         const int to_h) {
  RAY_OF_WORK_ITEM
  const int pixel = s < samples ? AT(hit, 0)[ray] : -1;
  const int row = max(pixel, 0) / from_w, column = max(pixel, 0) - row * from_w;
  AT(y, 0)[ray] = pixel < 0 ? -1 : cell_of(row, from_h, to_h) * to_w + cell_of(column, from_w, to_w);
}
