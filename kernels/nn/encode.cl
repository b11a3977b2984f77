// Positional encoding: y = [sin(2 pi B x), cos(2 pi B x)] per pixel (Tancik et al. 2020; with B a ladder of powers of two,
// Mildenhall et al. 2020). x {n, C, h, w}; B {m, C, 1, 1}, cycles per unit, not trained; y {n, 2 m, h, w}: sines, cosines.
// Whole turns are taken off before the angle is formed, so what is lost is the rounding of B x alone.
#include "lib/frame.clh"

// (cos, sin) of row j of B times what stands at `at`.
static inline real2 wave_of(global const real *x, global const real *row, int channels, int plane) {
  real turns = R(0);
  for (int c = 0; c < channels; ++c) turns = fma(row[c], x[(ulong)c * (ulong)plane], turns);
  return turn(turns - floor(turns));
}

kernel void encode(IN(x), IN(b), OUT(y), const int channels, const int features, const int plane) {
  const int i = (int)get_global_id(0), j = (int)get_global_id(1), n = (int)get_global_id(2);
  if (i >= plane) return;
  const real2 wave = wave_of(AT(x, n) + i, AT(b, j), channels, plane);
  AT(y, n)[(ulong)j * (ulong)plane + i] = wave.y;
  AT(y, n)[(ulong)(features + j) * (ulong)plane + i] = wave.x;
}

// dx = 2 pi B^T (cos g_sin - sin g_cos).
kernel void encode_adjoint(IN(x), IN(b), IN(g), OUT(dx), const int channels, const int features, const int plane) {
  const int i = (int)get_global_id(0), n = (int)get_global_id(1);
  if (i >= plane) return;
  for (int c = 0; c < channels; ++c) AT(dx, n)[(ulong)c * (ulong)plane + i] = R(0);
  for (int j = 0; j < features; ++j) {
    const real2 wave = wave_of(AT(x, n) + i, AT(b, j), channels, plane);
    const real g_sin = AT(g, n)[(ulong)j * (ulong)plane + i];
    const real g_cos = AT(g, n)[(ulong)(features + j) * (ulong)plane + i];
    const real slope = R(2) * PI * (wave.x * g_sin - wave.y * g_cos);
    for (int c = 0; c < channels; ++c) AT(dx, n)[(ulong)c * (ulong)plane + i] += AT(b, j)[c] * slope;
  }
}
