// The functions of the tracer's headers, one call a work-item: what tests look at them through. Arrays are rows of
// `count`.
#include "trace/scene.clh"

// Directions drawn from the sky's tables by pairs of numbers in [0, 1): direction 3, density at it.
kernel void probe_sky(global const real *sky, const int width, const int height, const float turn,
                      global const real *pairs, global real *out, const int count) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  Scene scene;
  scene.sky = sky, scene.panorama_width = width, scene.panorama_height = height, scene.panorama_turn = turn;
  const real3 d = sample_sky(&scene, pairs[i], pairs[count + i]);
  out[i] = d.x, out[count + i] = d.y, out[2 * count + i] = d.z;
  out[3 * count + i] = sky_pdf(&scene, d);
}

// A material at texture coordinates (3 rows) seen with a footprint (row 3), metres: albedo 3, roughness, metallic.
kernel void probe_texture(global const real *material, global const real *at, global real *out, const int count) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const Material m = textured(material, (real3)(at[i], at[count + i], at[2 * count + i]), at[3 * count + i]);
  out[i] = m.albedo.x, out[count + i] = m.albedo.y, out[2 * count + i] = m.albedo.z;
  out[3 * count + i] = m.roughness, out[4 * count + i] = m.metallic;
}
