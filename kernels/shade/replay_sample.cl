// What lies between a pixel's maps and a direction that shade/sample_brdf.cl drew for it: the numbers that placed it and
// how the surface sees it. For people who ask how a sample came to be.
//
// Maps, camera and rays as there; direction {1, 3, pixels, samples}. y {1, 21, pixels, samples}: random numbers 4, 0 of
// the grid, which draws none; frame t, b, n 9 (camera frame); view 3 and light 3 (local frame); alpha; probability of the
// specular lobe.
#include "lib/camera.clh"
#include "lib/chunk.clh"
#include "lib/ggx.clh"
#include "lib/li2020.clh"
#include "lib/rng.clh"
#include "lib/surface.clh"
#include "lib/view.clh"

#define SAMPLER_GRID 6

kernel void replay_sample(IN(camera), IN(normal), IN(albedo), IN(material), IN(direction), OUT(y), CHUNK_ARGS,
                          const int w, const int h, const uint seed) {
  RAY_OF_WORK_ITEM
  const int plane = w * h, n = (first_pixel + p) / plane, pixel = first_pixel + p - n * plane, j = pixel / w;
  const uint row = (uint)(first_pixel + p), index = (uint)(first_sample + s);
#if SAMPLER == SAMPLER_GRID
  const real4 u = (real4)(R(0));
#elif defined(SOBOL)
  const real4 u = sobol_point4(seed ^ SALT, row, index, 0u);
#else
  const real4 u = random4(seed ^ SALT, row, index, 0u);
#endif
  const Camera eye = camera_at(AT(camera, n));
  const real column = (real)(pixel - j * w) + R(0.5), line = (real)j + R(0.5);
  const real3 mapped = rgb_at(AT(normal, n), plane, pixel);
  const real3 raw = mapped / unit_near(mapped);
#if SAMPLER == SAMPLER_GRID
  const Frame frame = grid_frame(unit3(raw));
#else
  const Frame frame = frame_of(unit3(raw));
#endif
  const real3 wo = local_view(frame, raw, unproject(eye, column, line), unproject_rest(eye, column, line));
  const Material m = material_at(AT(albedo, n), AT(material, n), plane, pixel);
  global const real *along = AT(direction, 0) + ray;
  const real3 wi = to_local(frame, (real3)(along[0], along[RAY_PLANE], along[2 * RAY_PLANE]));
  const real values[21] = {u.x,       u.y,       u.z,       u.w,       frame.t.x, frame.t.y, frame.t.z,
                           frame.b.x, frame.b.y, frame.b.z, frame.n.x, frame.n.y, frame.n.z, wo.x,
                           wo.y,      wo.z,      wi.x,      wi.y,      wi.z,      alpha_of(m.roughness),
                           specular_probability(m, wo)};
  for (int c = 0; c < 21; ++c) AT(y, 0)[c * RAY_PLANE + ray] = values[c];
}
