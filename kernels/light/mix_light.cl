// Two lights mixed by how sure a hit is, Zhu et al. 2022, Eq. 6: y = (1 - u) near + u far.
// near, far, y {1, 3, pixels, samples}, u {1, 1, pixels, samples} (kernels/lib/chunk.clh).
#include "lib/chunk.clh"

kernel void mix_light(IN(near), IN(far), IN(u), OUT(y), CHUNK_ARGS) {
  RAY_OF_WORK_ITEM
  const real share = AT(u, 0)[ray];
  CHANNELS(c) {
    const ulong at = c * RAY_PLANE + ray;
    AT(y, 0)[at] = (R(1) - share) * AT(near, 0)[at] + share * AT(far, 0)[at];
  }
}

// d near = (1 - u) dy, d far = u dy, du = sum over channels of (far - near) dy.
kernel void mix_light_adjoint(IN(near), IN(far), IN(u), IN(dy), OUT(d_near), OUT(d_far), OUT(d_u), CHUNK_ARGS) {
  RAY_OF_WORK_ITEM
  const real share = AT(u, 0)[ray];
  real sum = R(0);
  CHANNELS(c) {
    const ulong at = c * RAY_PLANE + ray;
    const real g = AT(dy, 0)[at];
    AT(d_near, 0)[at] = (R(1) - share) * g;
    AT(d_far, 0)[at] = share * g;
    sum += (AT(far, 0)[at] - AT(near, 0)[at]) * g;
  }
  AT(d_u, 0)[ray] = sum;
}
