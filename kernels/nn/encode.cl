// Positional encoding: y = [sin(2 pi B x), cos(2 pi B x)] per pixel (Tancik et al. 2020; with B a ladder of powers of two,
// Mildenhall et al. 2020). x {n, C, h, w}; B {m, C, 1, 1}, cycles per unit, not trained; y {n, 2 m, h, w}: sines, cosines.
// Whole turns are taken off before the angle is formed, so what is lost is the rounding of B x alone.
#include "lib/turn.clh"
#include "lib/wave.clh"

// (cos, sin) of row j of B times what stands at `at`.
static inline real2 wave_of(global const real *x, global const real *row, int channels, int plane) {
  real turns = R(0);
  for (int c = 0; c < channels; ++c) turns = fma(row[c], x[(ulong)c * (ulong)plane], turns);
  return turn(turns - floor(turns));
}

// Rows: a block of the plane of one feature.
kernel void encode(IN(x), IN(b), OUT(y), const int channels, const int features, const int plane, const int block) {
  const int first = (int)get_group_id(0) * block, j = (int)get_group_id(1), n = (int)get_group_id(2);
  const int length = min(block, plane - first);
  global const real *row = AT(b, j), *x = AT(x, n) + first;
  global real *sines = AT(y, n) + (ulong)j * (ulong)plane + first;
  global real *cosines = sines + (ulong)features * (ulong)plane;
  FOR_ROW(i, length) {
    lanes turns = (lanes)(R(0)), sine, cosine;
    for (int c = 0; c < channels; ++c)
      turns = fma((lanes)(row[c]), lanes_load(x + (ulong)c * (ulong)plane + i, length - i), turns);
    wave(turns, &sine, &cosine);
    lanes_store(sine, sines + i, length - i);
    lanes_store(cosine, cosines + i, length - i);
  }
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
