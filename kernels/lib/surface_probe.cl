// The functions of the headers, one call a work-item: what tests look at them through. Arrays are rows of `count`.
#include "lib/ggx.clh"
#include "lib/rng.clh"

#ifndef SAMPLER
#define SAMPLER SAMPLER_VNDF_CAPS
#endif

static inline Material probe_material(global const real *surface) {
  Material m;
  m.albedo = (real3)(surface[0], surface[1], surface[2]);
  m.roughness = surface[3], m.metallic = surface[4];
  return m;
}

// Directions drawn for one view wo and surface (albedo, roughness, metallic): wi 3, weight 3, pdf, lobe probability.
// lobe: probability of the specular lobe; below 0: that of the surface.
kernel void probe_sample(global const real *surface, global const real *view, global real *out, const int count,
                         const uint seed, const real lobe) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const Material m = probe_material(surface);
  const real3 wo = (real3)(view[0], view[1], view[2]);
  const real p = lobe < R(0) ? specular_probability(m, wo) : lobe;
  const real4 u = random4(seed, 7u, (uint)i, 0u);
  const real3 wi = sample_direction(SAMPLER, wo, alpha_of(m.roughness), p, u.xyz);
  const real3 f = sample_weight(SAMPLER, m, wo, wi, p);
  out[i] = wi.x, out[count + i] = wi.y, out[2 * count + i] = wi.z;
  out[3 * count + i] = f.x, out[4 * count + i] = f.y, out[5 * count + i] = f.z;
  out[6 * count + i] = sampler_pdf(SAMPLER, wo, wi, alpha_of(m.roughness), p);
  out[7 * count + i] = p;
}

// For pairs of directions: D, f cos (3), pdf of the mixture.
kernel void probe_evaluate(global const real *surface, global const real *wo_rows, global const real *wi_rows,
                           global real *out, const int count) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const Material m = probe_material(surface);
  const real3 wo = (real3)(wo_rows[i], wo_rows[count + i], wo_rows[2 * count + i]);
  const real3 wi = (real3)(wi_rows[i], wi_rows[count + i], wi_rows[2 * count + i]);
  const real alpha = alpha_of(m.roughness);
  const real3 f = brdf_times_cosine(m, wo, wi);
  out[i] = ggx_d(wi + wo, alpha);
  out[count + i] = f.x, out[2 * count + i] = f.y, out[3 * count + i] = f.z;
  out[4 * count + i] = sampler_pdf(SAMPLER, wo, wi, alpha, specular_probability(m, wo));
}

// Four numbers of every sample of a pixel: independent and Sobol's. out: 8 rows.
kernel void probe_points(global real *out, const int count, const uint seed, const uint pixel, const uint block) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const real4 a = random4(seed, pixel, (uint)i, block), b = sobol_point4(seed, pixel, (uint)i, block);
  out[i] = a.x, out[count + i] = a.y, out[2 * count + i] = a.z, out[3 * count + i] = a.w;
  out[4 * count + i] = b.x, out[5 * count + i] = b.y, out[6 * count + i] = b.z, out[7 * count + i] = b.w;
}

// turn(u), and the frame of a normal: to_world(to_local(v)) for u rows of (u, nx, ny, nz, vx, vy, vz). out: 5 rows.
kernel void probe_frame(global const real *in, global real *out, const int count) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const real2 t = turn(in[i]);
  const Frame f = frame_of((real3)(in[count + i], in[2 * count + i], in[3 * count + i]));
  const real3 v = to_world(f, to_local(f, (real3)(in[4 * count + i], in[5 * count + i], in[6 * count + i])));
  out[i] = t.x, out[count + i] = t.y;
  out[2 * count + i] = v.x, out[3 * count + i] = v.y, out[4 * count + i] = v.z;
}
