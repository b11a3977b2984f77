// The small kernels around a convolution's product: weights into panels, partial sums together, the bias gradient.
#include "nn/conv_geometry.clh"

// weights[panel][k][8] = taps of output 8*panel + r at inner index k = (channel*taps_y + ty)*taps_x + tx, zero past the
// last output. Element (output, channel, ty, tx) is read at output*output_pitch + channel*channel_pitch +
// (first_y + ty*step_y)*kernel_w + first_x + tx*step_x: forward as stored, backward data transposed and flipped.
// Work-item (channel, panel), or (panel, channel) where `panels_first`: first what lies closer in the stored weights.
kernel void conv_pack_weights(IN(w), OUT(weights), const ConvGeometry g,
                              const int output_pitch, const int channel_pitch, const int kernel_w, const int2 first,
                              const int2 step, const int panels_first) {
  const int c = get_global_id(panels_first), panel = get_global_id(1 - panels_first);
  const int taps = g.taps_y * g.taps_x, outputs = min(g.outputs - 8 * panel, 8);
  if (c >= g.channels || outputs <= 0) return;
  global const real *tap = AT(w, 0) + (ulong)(8 * panel) * output_pitch + (ulong)c * channel_pitch +
                           first.y * kernel_w + first.x;
  global real *to = AT(weights, 0) + ((ulong)panel * g.channels + c) * taps * 8;
  for (int ty = 0; ty < g.taps_y; ++ty, tap += step.y * kernel_w)
    for (int tx = 0; tx < g.taps_x; ++tx, to += 8) {
      global const real *from = tap + tx * step.x;
#define OUTPUT(r) from[(ulong)(r) * output_pitch]
      if (outputs == 8) {  // by far most, and three times as fast as choosing each
        vstore8((real8)(OUTPUT(0), OUTPUT(1), OUTPUT(2), OUTPUT(3), OUTPUT(4), OUTPUT(5), OUTPUT(6), OUTPUT(7)), 0, to);
      } else {
        for (int r = 0; r < 8; ++r) to[r] = r < outputs ? OUTPUT(r) : R(0);
      }
    }
}

// to[row][column] = bias[column] + sum over s, in order, of partial[s][row][column]; `bias` is read when has_bias.
// Work-item (row * columns + column).
kernel void conv_sum_partials(IN(partial), IN(bias), OUT(to), const int rows, const int columns, const int row_pitch,
                              const int partials, const int has_bias) {
  const int i = get_global_id(0);
  if (i >= rows * columns) return;
  const int column = i % columns;
  real sum = R(0);
  for (int s = 0; s < partials; ++s) sum += AT(partial, 0)[(ulong)s * rows * columns + i];
  AT(to, 0)[(ulong)(i / columns) * row_pitch + column] = sum + (has_bias ? AT(bias, 0)[column] : R(0));
}

// to[n,c,i] = bias[c]. Work-item (i, c, n).
kernel void conv_fill_bias(IN(bias), OUT(to), const int plane) {
  const int i = get_global_id(0), c = get_global_id(1), n = get_global_id(2);
  if (i < plane) AT(to, n)[(ulong)c * plane + i] = AT(bias, 0)[c];
}
