// Volume rendering along rays (Zhu et al. 2022, Eq. 5; Max 1995, TVCG 1(2)): K segments of constant density and colour, the
// nearest first. density, length {K, 1, pixels, samples}, colour {K, 3, ...}; radiance {1, 3, ...}, transmittance
// {1, 1, ...} (kernels/lib/chunk.clh). With the optical depths t_k = density * length and T_k = exp(-sum_{j<k} t_j):
//   radiance = sum_k T_k (1 - exp(-t_k)) c_k,   transmittance = T_K.
// Optical depths are summed, never transmittances multiplied, and 1 - exp(-t) is -expm1(-t): thin segments keep all digits.
#include "lib/chunk.clh"

kernel void composite(IN(density), IN(colour), IN(length), OUT(radiance), OUT(transmittance), CHUNK_ARGS,
                      const int segments) {
  RAY_OF_WORK_ITEM
  real depth = R(0);
  real3 sum = (real3)(R(0));
  for (int k = 0; k < segments; ++k) {
    global const real *c = AT(colour, k) + ray;
    const real thickness = AT(density, k)[ray] * AT(length, k)[ray];
    const real share = exp(-depth) * -expm1(-thickness);
    sum += share * (real3)(c[0], c[RAY_PLANE], c[2 * RAY_PLANE]);
    depth += thickness;
  }
  global real *l = AT(radiance, 0) + ray;
  l[0] = sum.x, l[RAY_PLANE] = sum.y, l[2 * RAY_PLANE] = sum.z;
  AT(transmittance, 0)[ray] = exp(-depth);
}

// With B_k the light from segment k on as seen from its front, B_k = (1 - exp(-t_k)) c_k + exp(-t_k) B_{k+1}:
//   d c_k = T_k (1 - exp(-t_k)) g,   d t_k = T_{k+1} g . (c_k - B_{k+1}) - g_T T_K.
// On the way out d_density holds the optical depths before each segment.
kernel void composite_adjoint(IN(density), IN(colour), IN(length), IN(g_radiance), IN(g_transmittance), OUT(d_density),
                              OUT(d_colour), CHUNK_ARGS, const int segments) {
  RAY_OF_WORK_ITEM
  real depth = R(0);
  for (int k = 0; k < segments; ++k) {
    AT(d_density, k)[ray] = depth;
    depth += AT(density, k)[ray] * AT(length, k)[ray];
  }
  global const real *g_at = AT(g_radiance, 0) + ray;
  const real3 g = (real3)(g_at[0], g_at[RAY_PLANE], g_at[2 * RAY_PLANE]);
  const real g_end = AT(g_transmittance, 0)[ray] * exp(-depth);
  real3 behind = (real3)(R(0));
  for (int k = segments - 1; k >= 0; --k) {
    global const real *c_at = AT(colour, k) + ray;
    const real3 c = (real3)(c_at[0], c_at[RAY_PLANE], c_at[2 * RAY_PLANE]);
    const real across = AT(length, k)[ray], thickness = AT(density, k)[ray] * across;
    const real before = AT(d_density, k)[ray], solid = -expm1(-thickness);
    const real3 front = c - behind;
    const real seen = exp(-before - thickness) * (g.x * front.x + g.y * front.y + g.z * front.z);
    AT(d_density, k)[ray] = across * (seen - g_end);
    const real share = exp(-before) * solid;
    global real *d = AT(d_colour, k) + ray;
    d[0] = share * g.x, d[RAY_PLANE] = share * g.y, d[2 * RAY_PLANE] = share * g.z;
    behind += solid * front;
  }
}
