// A product in the register tile of lib/tile.clh and nothing else: what a tile is worth on a device (host/cl/tile.hpp).
#include "lib/tile.clh"

#define POSITIONS 48  // a multiple of every tile's

// sums[item][8][POSITIONS] = rounds * weights[k][8]^T * panel[k][POSITIONS], summed over k < depth round after round.
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void tile_product(global const real *weights,
                                                                       global const real *panel, global real *sums,
                                                                       const int depth, const int rounds) {
  sums += (int)get_global_id(0) * PANEL * POSITIONS;
  for (int i = 0; i < PANEL * POSITIONS; ++i) sums[i] = R(0);
  for (int round = 0; round < rounds; ++round)
    for (int f = 0; f < POSITIONS; f += TILE_VECTORS * TILE_WIDTH)
      for (int m = 0; m < PANEL; m += TILE_ROWS) {
        global real *to = sums + m * POSITIONS + f;
        vec sum[TILE_ROWS][TILE_VECTORS];
        FOR_TILE(TILE_VECTORS) sum[r][v] = vec_load(v, to + r * POSITIONS);
#define WEIGHT_OF(k, r) weights[(k) * PANEL + m + (r)]
#define POSITIONS_OF(k) (panel + (k) * POSITIONS + f)
        TILE_PRODUCT(TILE_VECTORS, sum, depth, WEIGHT_OF, POSITIONS_OF)
        FOR_TILE(TILE_VECTORS) vec_store(sum[r][v], v, to + r * POSITIONS);
      }
}
