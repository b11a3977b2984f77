// Vectors of three channels brought to length 1: n = t / max(|t|, 1e-6). t, n: {N, 3, H, W}. Work-item: one pixel.
#include "lib/real.clh"

#define PIXEL                                                            \
  const int i = (int)get_global_id(0), n = (int)get_global_id(1);        \
  if (i >= plane) return;                                                \
  global const real *p = AT(t, n) + i;                                   \
  const real x = p[0], y = p[plane], z = p[2 * plane];                   \
  const real length_of = sqrt(x * x + y * y + z * z);                    \
  const real inverse = R(1) / (length_of < R(1e-6) ? R(1e-6) : length_of);

kernel void unit_vector(IN(t), OUT(y_), const int plane) {
  PIXEL
  global real *to = AT(y_, n) + i;
  to[0] = inverse * x, to[plane] = inverse * y, to[2 * plane] = inverse * z;
}

// dt = (dn - n (n . dn)) / |t|, and dn / 1e-6 for shorter vectors, where n is linear in t.
kernel void unit_vector_adjoint(IN(dn), IN(t), OUT(dt), const int plane) {
  PIXEL
  global const real *d = AT(dn, n) + i;
  global real *to = AT(dt, n) + i;
  const real a = d[0], b = d[plane], c = d[2 * plane];
  const real along = length_of > R(1e-6) ? (x * a + y * b + z * c) * inverse * inverse : R(0);
  to[0] = inverse * (a - along * x), to[plane] = inverse * (b - along * y), to[2 * plane] = inverse * (c - along * z);
}
