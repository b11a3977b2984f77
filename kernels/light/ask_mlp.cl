// The in-view light's MLP in one kernel (Zhu et al. 2022, section 4.2): a ray looks up what the layers that read the
// input owe to the pixel it hits, encodes its direction by Fourier features (nn/encode.cl), and goes through all
// layers:
//   x_0 = relu(row_0 + D_0 e + b_0),   x_i = relu(W_i x_{i-1} + b_i),   f = W x_{L-1} + b,
// and in layer `again`, where there is one, x_i = relu(W_i x_{i-1} + row_1 + D_i e + b_i).
//
// rows {1, 1, h w, stride}: row_0, then row_1 of each pixel (light/pixel_rows.cl); hit Int {1, 1, pixels, samples}:
// pixel or -1; direction {1, 3, ...}, camera frame; frequencies {m, 3, 1, 1}, cycles per unit: e = [sin 2 pi B d, cos 2
// pi B d]; f {1, 3, ...}, zeroed before: misses stay 0. With `listed` only the rays list[0 ... count - 1] are asked,
// else all of the tile. packed, by light/pack_layer.cl: D_0 with b_0; of each further layer D_i with b_i and W_i
// without when i is `again`, else W_i with b_i; W with b. For inference: no adjoint.
#include "lib/chunk.clh"
#include "light/mlp.clh"

#define MOST_WIDTH 512
#define MOST_FREQUENCIES 256

// The row's share of a layer, of each ray's own pixel; that of a miss means nothing.
static void look_up(SHARED lanes *to, global const real *rows, SHARED const int *pixels, int stride, int first,
                    int width) {
#if GROUP == 1
  // 16 rays x 16 numbers at a time: one cache line of each ray's row is asked for at once.
  for (int c = 0; c < width; c += 16)
    for (int v = 0; v < VECTORS; ++v) {
      real16 block[16];
      for (int l = 0; l < 16; ++l)
        block[l] = vload16(0, rows + (ulong)max(pixels[16 * v + l], 0) * (ulong)stride + (ulong)(first + c));
      transpose(block);
      for (int i = 0; i < 16; ++i) to[VECTORS * (c + i) + v] = block[i];
    }
#else
  for (int v = 0; v < VECTORS; ++v) {
    global const real *row = rows + (ulong)max(pixels[v], 0) * (ulong)stride + (ulong)first;
    for (int c = (int)get_local_id(0); c < width; c += GROUP) to[VECTORS * c + v] = row[c];
  }
#endif
}

kernel void ask_mlp(IN(rows), IN_INT(hit), IN(direction), IN(frequencies), IN_INT(list), IN_INT(count), IN(packed),
                    OUT(f), CHUNK_ARGS, const int listed, const int stride, const int width, const int layers,
                    const int waves, const int again, NET_MEMORY) {
  const int first = (int)get_group_id(0) * RAYS, asked = listed ? AT(count, 0)[0] : pixels * sample_capacity;
  SHARED int rays[RAYS], hits[RAYS];
  SHARED lanes d[3 * VECTORS];
  if (first >= asked) return;
  NUMBERS(one, MOST_WIDTH, width);
  NUMBERS(other, MOST_WIDTH, width);
  NUMBERS(along, 2 * MOST_FREQUENCIES, 2 * waves);
  FOR_RAYS(l) {
    const int i = min(first + l, asked - 1), ray = listed ? AT(list, 0)[i] : i;
    global const real *from = AT(direction, 0) + ray;
    rays[l] = ray, hits[l] = HIT_OF(ray);
    for (int c = 0; c < 3; ++c) LANE(d + VECTORS * c, l) = from[c * RAY_PLANE];
  }
  GROUP_BARRIER;
  FOR_NUMBERS(j, v, waves) {
    global const real *b = AT(frequencies, j);
    const lanes turns = fma((lanes)(b[2]), d[2 * VECTORS + v], fma((lanes)(b[1]), d[VECTORS + v], b[0] * d[v]));
    lanes sine, cosine;
    wave(turns, &sine, &cosine);
    along[VECTORS * j + v] = sine, along[VECTORS * (waves + j) + v] = cosine;
  }
  global const real *weights = AT(packed, 0);
  SHARED lanes *from = one, *to = other;
  look_up(from, AT(rows, 0), hits, stride, 0, width);
  dense(from, along, weights, 2 * waves, width, 1, 1);
  weights += PACKED(2 * waves, width);
  for (int layer = 1; layer < layers; ++layer) {
    const int reads = layer == again;
    if (reads) {
      look_up(to, AT(rows, 0), hits, stride, width, width);
      dense(to, along, weights, 2 * waves, width, 1, 0);
      weights += PACKED(2 * waves, width);
    }
    dense(to, from, weights, width, width, reads, 1);
    weights += PACKED(width, width);
    SHARED lanes *const written = to;
    to = from, from = written;
  }
  dense(to, from, weights, width, 3, 0, 0);
  FOR_RAYS(l) {
    if (first + l >= asked) break;
    global real *y = AT(f, 0) + rays[l];
    for (int c = 0; c < 3; ++c) y[c * RAY_PLANE] = hits[l] < 0 ? R(0) : LANE(to + VECTORS * c, l);
  }
}
