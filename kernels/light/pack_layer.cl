// Weights of one layer laid out for dense() of light/mlp.clh: panels of 8 outputs, of each [k][8] for every input k and
// then the 8 biases; zero past the last output, and biases zero when has_bias is 0. weight {out, in, 1, 1} or, when
// transposed, {in, out, 1, 1}; bias {1, out, 1, 1}; the layer starts `at` elements into packed. Work-item (k, panel),
// k = in: the biases.
#include "lib/real.clh"

kernel void pack_layer(IN(weight), IN(bias), OUT(packed), const int in, const int out, const int has_bias,
                       const int at, const int transposed) {
  const int k = (int)get_global_id(0), panel = (int)get_global_id(1);
  if (k > in) return;
  global real *to = AT(packed, 0) + at + (panel * (in + 1) + k) * 8;
  global const real *from = transposed ? AT(weight, k) : AT(weight, 0) + k;
  const int step = transposed ? 1 : weight_stride;
  for (int r = 0; r < 8; ++r) {
    const int m = panel * 8 + r;
    real value = R(0);
    if (m < out) value = k < in ? from[(ulong)m * (ulong)step] : has_bias ? AT(bias, 0)[m] : R(0);
    to[r] = value;
  }
}
