// What a device can do at most, measured: see host/cl/ceilings.hpp. The results are written out so that no work can be
// left away; nobody reads them.
#include "lib/real.clh"

#define CHAINS 12  // independent, so that the latency of one multiply-add is hidden behind the others
#ifndef WIDTH
#define WIDTH 16
#endif
#define JOIN2(a, b) a##b
#define JOIN(a, b) JOIN2(a, b)
#define vec JOIN(real, WIDTH)

// `rounds` times CHAINS multiply-adds on vectors of WIDTH numbers: 2 * WIDTH * CHAINS * rounds operations a work-item. For
// devices with vector registers (CPUs), of which sums, factor and term take 14: fewer than any has, if WIDTH is theirs.
kernel void fma_wide(global real *out, const int rounds, const real factor, const real term) {
  const int id = (int)get_global_id(0);
  vec sum[CHAINS];
#pragma unroll
  for (int c = 0; c < CHAINS; ++c) sum[c] = (vec)(R(id + c));
  const vec a = (vec)(factor), b = (vec)(term);
  for (int round = 0; round < rounds; ++round) {
#pragma unroll
    for (int c = 0; c < CHAINS; ++c) sum[c] = fma(sum[c], a, b);
  }
  vec total = sum[0];
#pragma unroll
  for (int c = 1; c < CHAINS; ++c) total += sum[c];
  JOIN(vstore, WIDTH)(total, id, out);
}

// The same with one number a chain, for devices that put work-items into lanes (GPUs): 2 * CHAINS * rounds operations.
kernel void fma_narrow(global real *out, const int rounds, const real factor, const real term) {
  const int id = (int)get_global_id(0);
  real sum[CHAINS];
#pragma unroll
  for (int c = 0; c < CHAINS; ++c) sum[c] = R(id + c);
  for (int round = 0; round < rounds; ++round) {
#pragma unroll
    for (int c = 0; c < CHAINS; ++c) sum[c] = fma(sum[c], factor, term);
  }
  real total = sum[0];
#pragma unroll
  for (int c = 1; c < CHAINS; ++c) total += sum[c];
  out[id] = total;
}

// c = a + factor * b, the triad of McCalpin's STREAM (1995): two numbers read and one written each.
kernel void triad_wide(global const real16 *a, global const real16 *b, global real16 *c, const real factor) {
  const int i = (int)get_global_id(0);
  c[i] = a[i] + factor * b[i];
}

// The same for devices that join the accesses of neighbouring work-items (GPUs).
kernel void triad_narrow(global const real *a, global const real *b, global real *c, const real factor) {
  const int i = (int)get_global_id(0);
  c[i] = a[i] + factor * b[i];
}

kernel void nothing(global real *out, const int never) {
  if (never) out[get_global_id(0)] = R(0);
}
