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

// The pixel that the ray belongs to: picture n, row j, index in its plane.
#define PIXEL_OF_RAY                                   \
  const int plane = w * h;                             \
  const int n = (first_pixel + p) / plane;             \
  const int pixel = first_pixel + p - n * plane;       \
  const int j = pixel / w;

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
  RAY_OF_WORK_ITEM
  PIXEL_OF_RAY

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

// Detached adjoint: what the weights of rays give to the evaluation maps, as f cos of fixed directions over a fixed pdf.
// d_surface {1, 8, pixels, samples}: normal 3 (of the map as it is, of any length), albedo 3, roughness, metallic; 0
// where there is no direction. With S = cos_i t(cos_o) + cos_o t(cos_i), V = 1 / (2 S) and k from D = k^2 / pi
// (lib/ggx.clh):  dV = -2 V^2 dS,  dk/dh.z = 2 alpha |h|^2 h.z (1 - alpha^2) / q^2,
// dk/dalpha = |h|^2 (h.x^2 + h.y^2 - alpha^2 h.z^2) / q^2,  q = h.x^2 + h.y^2 + alpha^2 h.z^2.
kernel void sample_brdf_adjoint(IN(camera), IN(normal), IN(albedo), IN(material), IN(direction), IN(pdf), IN(d_weight),
                                OUT(d_surface), CHUNK_ARGS, const int w, const int h) {
  RAY_OF_WORK_ITEM
  PIXEL_OF_RAY

  const real3 raw = rgb_at(AT(normal, n), plane, pixel);
  const Frame frame = frame_of(unit3(raw));
  const Material m = material_at(AT(albedo, n), AT(material, n), plane, pixel);
  global const real *d = AT(direction, 0) + ray, *dw = AT(d_weight, 0) + ray;
  const real3 wo = to_local(frame, -unit3(pixel_ray(camera_at(AT(camera, n)), pixel - j * w, j)));
  const real3 wi = to_local(frame, (real3)(d[0], d[RAY_PLANE], d[2 * RAY_PLANE]));
  const real density = AT(pdf, 0)[ray];
  const real3 arriving = (real3)(dw[0], dw[RAY_PLANE], dw[2 * RAY_PLANE]);
  const int valid = s < samples && density > R(0) && wi.z > R(0) && wo.z > R(0) &&
                    fabs(arriving.x) + fabs(arriving.y) + fabs(arriving.z) > R(0);
  const real3 g = arriving / density;

  const real alpha = alpha_of(m.roughness), a2 = alpha * alpha;
  const real3 half_way = wi + wo;
  const real across = half_way.x * half_way.x + half_way.y * half_way.y, hz = half_way.z, h2 = across + hz * hz;
  const real q = across + a2 * hz * hz;
  const real k = alpha * h2 / q, dist = k * k * INV_PI;
  const real dist_k = R(2) * k * INV_PI;
  const real dist_hz = dist_k * R(2) * k * hz * (R(1) - a2) / q;
  const real dist_alpha = dist_k * (h2 / q) * ((across - a2 * hz * hz) / q);

  const real ti = smith_t(wi.z, alpha), to = smith_t(wo.z, alpha);
  const real v = smith_v(wi.z, wo.z, alpha), v_s = R(-2) * v * v;
  const real v_ci = v_s * (to + wo.z * (wi.z * (R(1) - a2) / ti));
  const real v_co = v_s * (ti + wi.z * (wo.z * (R(1) - a2) / to));
  const real v_alpha = v_s * alpha * (wi.z * (R(1) - wo.z * wo.z) / to + wo.z * (R(1) - wi.z * wi.z) / ti);

  const real3 fresnel = schlick(specular_f0(m), half_cosine(wo, wi));
  const real f_f0 = schlick((real3)(R(0)), half_cosine(wo, wi)).x;  // F = f0 + (1 - f0) times this
  const real lobe = dist * v * wi.z, lambert = wi.z * INV_PI;
  const real to_lobe = dot3(g, fresnel);
  const real d_ci = dot3(g, diffuse_albedo(m)) * INV_PI + to_lobe * dist * (v + wi.z * v_ci);
  const real d_co = to_lobe * dist * wi.z * v_co;
  const real d_hz = to_lobe * v * wi.z * dist_hz;
  const real d_alpha = to_lobe * wi.z * (dist_alpha * v + dist * v_alpha);

  // Along the normal nothing changes but its length.
  const real3 turned = d_ci * wi + d_co * wo + d_hz * half_way;
  const real length = sqrt(dot3(raw, raw));
  const real3 d_normal = to_world(frame, (real3)(turned.x, turned.y, R(0))) / (length > R(0) ? length : R(1));
  const real3 d_f0 = g * ((R(1) - f_f0) * lobe);
  const real3 d_albedo = g * ((R(1) - m.metallic) * lambert) + d_f0 * m.metallic;
  const real d_roughness = alpha > R(1e-4) ? R(2) * m.roughness * d_alpha : R(0);
  const real d_metallic = dot3(d_f0, m.albedo - R(0.04)) - dot3(g, m.albedo) * lambert;

  const real values[8] = {d_normal.x, d_normal.y, d_normal.z, d_albedo.x, d_albedo.y, d_albedo.z, d_roughness, d_metallic};
  for (int c = 0; c < 8; ++c) AT(d_surface, 0)[c * RAY_PLANE + ray] = valid ? values[c] : R(0);
}
