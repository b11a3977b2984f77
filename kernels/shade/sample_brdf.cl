// Directions of incoming light drawn for every pixel by its surface, and what light from there is worth.
//
// Pixel: depth {n, 1, h, w} (0 = none), normal {n, 3} and albedo {n, 3}, material {n, 2 or more} (roughness, metallic),
// camera {n, 4, 1, 1}. Rays {1, C, pixels, samples} (kernels/lib/chunk.clh): direction 3, camera frame, unit, (0, 0, 0)
// where there is none; weight 3 = f cos / pdf; pdf 1, 1/sr, of the whole mixture, 0 where there is no direction.
// The directions, pdf and lobe probabilities come from the sampling maps and are detached; weights are those of the
// evaluation maps (DETACHED), or of the same maps, and then in the form of kernels/lib/ggx.clh in which D cancels.
// status {1, 1, pixels, 1}: 0 shaded, 1 no depth, 2 the normal faces away from the viewer (n.v <= 0) or
// is not a number.
//
// SAMPLER: as in ggx.clh, or 6: the 8 x 16 grid of Li et al. 2020, sample = direction. SOBOL: points by Owen-scrambled
// Sobol, else independent. LI2020: their surface model instead of ours.
#include "lib/camera.clh"
#include "lib/chunk.clh"
#include "lib/ggx.clh"
#include "lib/li2020.clh"
#include "lib/rng.clh"

#define SAMPLER_GRID 6
#ifndef SAMPLER
#define SAMPLER SAMPLER_VNDF_CAPS
#endif
#define SALT 0x62726466u

static inline real3 rgb_at(global const real *map, int plane, int pixel) {
  return (real3)(map[pixel], map[plane + pixel], map[2 * plane + pixel]);
}
static inline Material material_at(global const real *albedo, global const real *material, int plane, int pixel) {
  Material m;
  m.albedo = rgb_at(albedo, plane, pixel);
  m.roughness = material[pixel];
  m.metallic = material[plane + pixel];
  return m;
}

static inline real3 f_times_cosine(Material m, real3 wo, real3 wi) {
#ifdef LI2020
  return li2020_times_cosine(m, wo, wi);
#else
  return brdf_times_cosine(m, wo, wi);
#endif
}

kernel void sample_brdf(IN(depth), IN(camera), IN(normal), IN(albedo), IN(material),
#ifdef DETACHED
                        IN(e_normal), IN(e_albedo), IN(e_material),
#endif
                        OUT(direction), OUT(weight), OUT(pdf), OUT(status), CHUNK_ARGS, const int w, const int h,
                        const uint seed) {
  const int s = (int)get_global_id(0);
  const int p = (int)get_global_id(1);
  if (s >= sample_capacity || p >= pixels) return;
  const int plane = w * h;
  const int n = (first_pixel + p) / plane;
  const int pixel = first_pixel + p - n * plane;
  const int j = pixel / w;

  const real3 view = -unit3(pixel_ray(camera_at(AT(camera, n)), pixel - j * w, j));
  const real3 raw = rgb_at(AT(normal, n), plane, pixel);
  const Material m = material_at(AT(albedo, n), AT(material, n), plane, pixel);
  const int has_depth = AT(depth, n)[pixel] > R(0);
  const int shaded = has_depth && dot3(raw, view) > R(0);

#if SAMPLER == SAMPLER_GRID
  const Frame frame = grid_frame(unit3(raw));
#else
  const Frame frame = frame_of(unit3(raw));
#endif
  const real3 wo = to_local(frame, view);
  const uint index = (uint)(first_sample + s);
#if SAMPLER == SAMPLER_GRID
  const real3 wi = grid_direction((int)index);
  const real density = grid_pdf((int)index);
#else
#ifdef SOBOL
  const real4 u = sobol_point4(seed ^ SALT, (uint)(first_pixel + p), index, 0u);
#else
  const real4 u = random4(seed ^ SALT, (uint)(first_pixel + p), index, 0u);
#endif
  const real alpha = alpha_of(m.roughness);
  const real chance = specular_probability(m, wo);
  const real3 wi = sample_direction(SAMPLER, wo, alpha, chance, u.xyz);
  const real density = sampler_pdf(SAMPLER, wo, wi, alpha, chance);
#endif

  // Not wi.z > 0: a direction that is not a number is handed on, to be dropped and counted where samples are summed.
  const int valid = shaded && s < samples && !(wi.z <= R(0));
  const real3 towards = to_world(frame, wi);
#ifdef DETACHED
  const Frame e_frame = frame_of(unit3(rgb_at(AT(e_normal, n), plane, pixel)));
  const Material e = material_at(AT(e_albedo, n), AT(e_material, n), plane, pixel);
  const real3 worth = f_times_cosine(e, to_local(e_frame, view), to_local(e_frame, towards)) / density;
#elif SAMPLER == SAMPLER_GRID || defined(LI2020)
  const real3 worth = f_times_cosine(m, wo, wi) / density;
#else
  const real3 worth = sample_weight(SAMPLER, m, wo, wi, chance);
#endif

  const ulong ray = RAY(p, s);
  global real *d = AT(direction, 0) + ray, *f = AT(weight, 0) + ray;
  d[0] = valid ? towards.x : R(0);
  d[RAY_PLANE] = valid ? towards.y : R(0);
  d[2 * RAY_PLANE] = valid ? towards.z : R(0);
  f[0] = valid ? worth.x : R(0);
  f[RAY_PLANE] = valid ? worth.y : R(0);
  f[2 * RAY_PLANE] = valid ? worth.z : R(0);
  AT(pdf, 0)[ray] = valid ? density : R(0);
  if (s == 0) AT(status, 0)[p] = first_sample > 0 || shaded ? R(0) : has_depth ? R(2) : R(1);
}
