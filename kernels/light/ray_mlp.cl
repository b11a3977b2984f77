// The in-view light's MLP along rays as it trains (Zhu et al. 2022, section 4.2):
//   x_0 = relu(input_0 + D_0 e + b_0),   x_i = relu(W_i x_{i-1} + b_i),   f = W x_{L-1} + b,
// and in layer `again`, where there is one, x_i = relu(W_i x_{i-1} + input_1 + D_i e + b_i). All layers of a few rays
// are one kernel, forward and back; between them stands only what the weights' gradients read, laid out for their
// products, whose sums over rays no other work-item shares: no atomics, the same bits from run to run.
//
// input {1, width or 2 width, P, S}: input_0, input_1; encoded {1, E, P, S}: e; f {1, 3, P, S}. Weights are packed by
// light/pack_layer.cl. Kept numbers of rays lie in blocks of BLOCK_RAYS: columns [n / 16][ray][16] where they are
// multiplied by slopes, panels [n / 8][ray][8] where they are the slopes; n is rounded up to 16. Rays beyond the last
// repeat it, and their slopes are zero.
#include "light/mlp.clh"

#define MOST_WIDTH 512
#define MOST_FEATURES 1024
#define BLOCK_RAYS 48   // a multiple of RAYS
#define COLUMNS 16      // a multiple of every tile's TILE_WIDTH
#define DEPTH_BLOCKS 3  // rays of so many blocks are multiplied at a time: their columns stay in the first cache
#define ROUNDED(n) (((n) + COLUMNS - 1) / COLUMNS * COLUMNS)
#define BLOCK(n) ((ulong)ROUNDED(n) * BLOCK_RAYS)

#if GROUP == 1
// RAYS numbers from `first` on of each of `channels` planes of `rays`.
static void load_rays(lanes *to, global const real *from, int channels, int rays, int first) {
  for (int c = 0; c < channels; ++c, from += rays)
    if (first + RAYS <= rays)
      for (int v = 0; v < VECTORS; ++v) to[VECTORS * c + v] = lanes_load(from + first + LANES * v, LANES);
    else
      for (int l = 0; l < RAYS; ++l) LANE(to + VECTORS * c, l) = from[min(first + l, rays - 1)];
}

static void store_rays(global real *to, const lanes *from, int channels, int rays, int first) {
  for (int c = 0; c < channels; ++c, to += rays)
    if (first + RAYS <= rays)
      for (int v = 0; v < VECTORS; ++v) lanes_store(from[VECTORS * c + v], to + first + LANES * v, LANES);
    else
      for (int l = 0; first + l < rays; ++l) to[first + l] = LANE(from + VECTORS * c, l);
}

// Numbers k to k + 15 of 16 rays: numbers beyond the last are zero.
static inline void strip_of(real16 *strip, const lanes *x, int v, int k, int count) {
  for (int i = 0; i < 16; ++i) strip[i] = k + i < count ? x[VECTORS * (k + i) + v] : (lanes)(R(0));
  transpose(strip);
}

#define BLOCK_OF(kept, count, width) \
  ((kept) + (ulong)(first / BLOCK_RAYS) * BLOCK(count) + first % BLOCK_RAYS * (width))

// `count` numbers of RAYS rays from `first` on, to their block as columns.
static void keep_columns(global real *kept, const lanes *x, int count, int first) {
  global real *block = BLOCK_OF(kept, count, COLUMNS);
  for (int k = 0; k < ROUNDED(count); k += 16)
    for (int v = 0; v < VECTORS; ++v) {
      global real *to = block + k * BLOCK_RAYS + LANES * v * COLUMNS;
      real16 strip[16];
      strip_of(strip, x, v, k, count);
      for (int l = 0; l < 16; ++l) vstore16(strip[l], 0, to + l * COLUMNS);
    }
}

// The same as panels.
static void keep_panels(global real *kept, const lanes *x, int count, int first) {
  global real *block = BLOCK_OF(kept, count, PANEL);
  for (int k = 0; k < ROUNDED(count); k += 16)
    for (int v = 0; v < VECTORS; ++v) {
      global real *to = block + k * BLOCK_RAYS + LANES * v * PANEL;
      real16 strip[16];
      strip_of(strip, x, v, k, count);
      for (int l = 0; l < 16; ++l) {
        vstore8(strip[l].lo, 0, to + l * PANEL);
        vstore8(strip[l].hi, 0, to + (BLOCK_RAYS + l) * PANEL);
      }
    }
}

// Slopes of what relu let through, 0 of the rest: those of `count` kept columns.
static void gate(lanes *slopes, global const real *kept, int count, int first) {
  global const real *block = BLOCK_OF(kept, count, COLUMNS);
  for (int k = 0; k < count; k += 16)
    for (int v = 0; v < VECTORS; ++v) {
      global const real *from = block + k * BLOCK_RAYS + LANES * v * COLUMNS;
      real16 strip[16];
      for (int l = 0; l < 16; ++l) strip[l] = vload16(0, from + l * COLUMNS);
      transpose(strip);
      for (int i = 0; i < 16; ++i) {
        lanes *to = slopes + VECTORS * (k + i) + v;
        *to = WHERE(strip[i] > R(0), *to, R(0));
      }
    }
}
#else
// The same by a group, whose items take numbers that lie side by side in memory.
static void load_rays(local lanes *to, global const real *from, int channels, int rays, int first) {
  FOR_NUMBERS(c, v, channels) to[VECTORS * c + v] = from[(ulong)c * (ulong)rays + min(first + v, rays - 1)];
  GROUP_BARRIER;
}

static void store_rays(global real *to, local const lanes *from, int channels, int rays, int first) {
  FOR_NUMBERS(c, v, channels) {
    if (first + v < rays) to[(ulong)c * (ulong)rays + first + v] = from[VECTORS * c + v];
  }
}

#define BLOCK_OF(kept, count, width) \
  ((kept) + (ulong)(first / BLOCK_RAYS) * BLOCK(count) + first % BLOCK_RAYS * (width))
// Number k of ray v for each of `count` numbers and those that fill the last strip of `width`, a strip of a ray after
// the other; `at` is its place in a block.
#define FOR_STRIPS(k, v, at, count, width)                                                                       \
  for (int i = (int)get_local_id(0), k, v, at;                                                                   \
       k = i / (VECTORS * (width)) * (width) + i % (width), v = i / (width) % VECTORS,                           \
           at = i / (VECTORS * (width)) * (width)*BLOCK_RAYS + i % (VECTORS * (width)), i < ROUNDED(count) * VECTORS; \
       i += GROUP)

static void keep_columns(global real *kept, local const lanes *x, int count, int first) {
  global real *block = BLOCK_OF(kept, count, COLUMNS);
  FOR_STRIPS(k, v, at, count, COLUMNS) block[at] = k < count ? x[VECTORS * k + v] : R(0);
}

static void keep_panels(global real *kept, local const lanes *x, int count, int first) {
  global real *block = BLOCK_OF(kept, count, PANEL);
  FOR_STRIPS(k, v, at, count, PANEL) block[at] = k < count ? x[VECTORS * k + v] : R(0);
}

static void gate(local lanes *slopes, global const real *kept, int count, int first) {
  global const real *block = BLOCK_OF(kept, count, COLUMNS);
  FOR_STRIPS(k, v, at, count, COLUMNS) {
    if (k < count && !(block[at] > R(0))) slopes[VECTORS * k + v] = R(0);
  }
  GROUP_BARRIER;
}
#endif

// packed: D_0 with b_0; of each further layer D_i with b_i and W_i without when i is `again`, else W_i with b_i; W with
// b. kept: columns of e, then of x_0, x_1, ...
kernel void ray_mlp(IN(input), IN(encoded), IN(packed), OUT(f), OUT(kept), const int rays, const int features,
                    const int width, const int layers, const int again, NET_MEMORY) {
  const int first = (int)get_group_id(0) * RAYS, blocks = (rays + BLOCK_RAYS - 1) / BLOCK_RAYS;
  if (first >= blocks * BLOCK_RAYS) return;
  NUMBERS(along, MOST_FEATURES, features);
  NUMBERS(one, MOST_WIDTH, ROUNDED_PANELS(width));
  NUMBERS(other, MOST_WIDTH, ROUNDED_PANELS(width));
  global const real *weights = AT(packed, 0);
  global real *columns = AT(kept, 0);
  load_rays(along, AT(encoded, 0), features, rays, first);
  keep_columns(columns, along, features, first);
  columns += (ulong)blocks * BLOCK(features);
  SHARED lanes *from = one, *to = other;
  load_rays(from, AT(input, 0), width, rays, first);
  dense(from, along, weights, features, width, 1, 1);
  weights += PACKED(features, width);
  for (int layer = 1; layer < layers; ++layer) {
    keep_columns(columns, from, width, first);
    columns += (ulong)blocks * BLOCK(width);
    const int reads = layer == again;
    if (reads) {
      load_rays(to, AT(input, 0) + (ulong)width * (ulong)rays, width, rays, first);
      dense(to, along, weights, features, width, 1, 0);
      weights += PACKED(features, width);
    }
    dense(to, from, weights, width, width, reads, 1);
    weights += PACKED(width, width);
    SHARED lanes *const written = to;
    to = from, from = written;
  }
  keep_columns(columns, from, width, first);
  dense(to, from, weights, width, 3, 0, 0);
  store_rays(AT(f, 0), to, 3, rays, first);
}

// The way back. packed: the transposes of W, W_{L-1}, ..., W_1; kept: columns of x_0, x_1, ...; slopes: panels of the
// gradients of each layer's sums, of f last; d_input: those of the layers that read the input.
kernel void ray_mlp_slopes(IN(g), IN(packed), IN(kept), OUT(slopes), OUT(d_input), const int rays, const int width,
                           const int layers, const int again, NET_MEMORY) {
  const int first = (int)get_group_id(0) * RAYS, blocks = (rays + BLOCK_RAYS - 1) / BLOCK_RAYS;
  if (first >= blocks * BLOCK_RAYS) return;
  NUMBERS(one, MOST_WIDTH, ROUNDED_PANELS(width));
  NUMBERS(other, MOST_WIDTH, ROUNDED_PANELS(width));
  const ulong size = (ulong)blocks * BLOCK(width);
  global const real *weights = AT(packed, 0);
  SHARED lanes *from = one, *to = other;
  load_rays(from, AT(g, 0), 3, rays, first);
  FOR_RAYS(l) {
    if (first + l < rays) continue;
    for (int c = 0; c < 3; ++c) LANE(from + VECTORS * c, l) = R(0);
  }
  GROUP_BARRIER;
  keep_panels(AT(slopes, 0) + layers * size, from, 3, first);
  dense(to, from, weights, 3, width, 0, 0);
  weights += PACKED(3, width);
  for (int layer = layers - 1; layer >= 0; --layer) {
    gate(to, AT(kept, 0) + layer * size, width, first);
    keep_panels(AT(slopes, 0) + layer * size, to, width, first);
    if (layer == 0 || layer == again)
      store_rays(AT(d_input, 0) + (layer == 0 ? 0 : (ulong)width * (ulong)rays), to, width, rays, first);
    if (layer == 0) break;
    SHARED lanes *const slope = to;
    to = from, from = slope;
    dense(to, from, weights, width, width, 0, 0);
    weights += PACKED(width, width);
  }
}

// `left` numbers of a vector, or all of it where there are as many.
static inline void put_sum(global real *to, const vec sum, const int left, const int add) {
  if (left >= TILE_WIDTH) {
    vec_store(add ? vec_load(0, to) + sum : sum, 0, to);
    return;
  }
  real part[TILE_WIDTH];
  vec_store(sum, 0, part);
  for (int j = 0; j < left; ++j) to[j] = add ? to[j] + part[j] : part[j];
}

// to[m][k] (+)= sums of slopes[m] times columns[k] over the rays of `count` blocks, for up to TILE_ROWS `rows` and
// `vectors` vectors from column k on, of which `left` columns are there; `add` keeps what is in `to`.
#define DEFINE_SUM_TILE(vectors)                                                                                     \
  static void sum_tile_##vectors(global real *to, int pitch, int rows, int left, global const real *slopes,          \
                                 ulong slopes_block, global const real *columns, ulong columns_block, int k,         \
                                 int count, int add) {                                                               \
    vec sum[TILE_ROWS][vectors];                                                                                     \
    FOR_TILE(vectors) sum[r][v] = (vec)(R(0));                                                                       \
    for (int b = 0; b < count; ++b, slopes += slopes_block, columns += columns_block) {                              \
      global const real *from[vectors];                                                                              \
      UNROLL for (int v = 0; v < vectors; ++v) {                                                                     \
        const int column = k + v * TILE_WIDTH;                                                                       \
        from[v] = columns + column / COLUMNS * COLUMNS * BLOCK_RAYS + column % COLUMNS;                              \
      }                                                                                                              \
      for (int ray = 0; ray < BLOCK_RAYS; ++ray) {                                                                   \
        vec row[vectors];                                                                                            \
        UNROLL for (int v = 0; v < vectors; ++v) row[v] = vec_load(0, from[v] + ray * COLUMNS);                      \
        FOR_TILE(vectors) sum[r][v] = fma((vec)(slopes[ray * PANEL + r]), row[v], sum[r][v]);                        \
      }                                                                                                              \
    }                                                                                                                \
    UNROLL for (int r = 0; r < TILE_ROWS; ++r) {                                                                     \
      if (r < rows) {                                                                                                \
        UNROLL for (int v = 0; v < vectors; ++v)                                                                     \
          put_sum(to + r * pitch + v * TILE_WIDTH, sum[r][v], left - v * TILE_WIDTH, add);                           \
      }                                                                                                              \
    }                                                                                                                \
  }

DEFINE_SUM_TILE(1)
DEFINE_SUM_TILE(2)
DEFINE_SUM_TILE(3)

// bias[m] (+)= sums of slopes[m] over the rays of `count` blocks, for a panel, of which `rows` are there.
static void sum_panel(global real *bias, int rows, global const real *slopes, ulong slopes_block, int count, int add) {
  real8 even = (real8)(R(0)), odd = (real8)(R(0));
  for (int b = 0; b < count; ++b, slopes += slopes_block)
    for (int ray = 0; ray < BLOCK_RAYS; ray += 2) even += vload8(ray, slopes), odd += vload8(ray + 1, slopes);
  real part[PANEL];
  vstore8(even + odd, 0, part);
  for (int r = 0; r < min(PANEL, rows); ++r) bias[r] = add ? bias[r] + part[r] : part[r];
}

// Gradients of a layer's weights {out, in, 1, 1} and, with has_bias, of its bias {1, out, 1, 1}: sums over all rays of
// slope times number, DEPTH_BLOCKS blocks of rays after the other. slopes: panels; columns: of the layer's input.
// Work-item (columns_each columns, rows_each rows).
kernel void ray_mlp_weights(IN(slopes), IN(columns), OUT(gradient), OUT(bias), const int blocks, const int in,
                            const int out, const int has_bias, const int columns_each, const int rows_each) {
  const int first_column = (int)get_global_id(0) * columns_each, first_row = (int)get_global_id(1) * rows_each;
  const int end_column = min(first_column + columns_each, in), end_row = min(first_row + rows_each, out);
  for (int begin = 0; begin < blocks; begin += DEPTH_BLOCKS) {
    const int count = min(DEPTH_BLOCKS, blocks - begin), add = begin > 0;
    global const real *slope = AT(slopes, 0) + begin * BLOCK(out), *column = AT(columns, 0) + begin * BLOCK(in);
    for (int k = first_column; k < end_column;) {
      const int left = (end_column - k + TILE_WIDTH - 1) / TILE_WIDTH;
      const int vectors = left == 4 ? 2 : min(left, TILE_VECTORS);  // two twos are faster than three and one
      for (int m = first_row; m < end_row; m += TILE_ROWS) {
        global real *to = AT(gradient, m) + k;
        global const real *panel = slope + m / PANEL * PANEL * BLOCK_RAYS + m % PANEL;
#define SUM_TILE(vectors)                                                                                  \
  sum_tile_##vectors(to, gradient_stride, end_row - m, end_column - k, panel, BLOCK(out), column, BLOCK(in), k, \
                     count, add)
        if (vectors == 3)
          SUM_TILE(3);
        else if (vectors == 2)
          SUM_TILE(2);
        else
          SUM_TILE(1);
#undef SUM_TILE
      }
      k += vectors * TILE_WIDTH;
    }
    if (!has_bias || first_column > 0) continue;
    for (int m = first_row; m < end_row; m += PANEL)
      sum_panel(AT(bias, 0) + m, end_row - m, slope + m * BLOCK_RAYS, BLOCK(out), count, add);
  }
}
