// Directions of incoming light drawn for every pixel by its surface, and what light from there is worth.
//
// Pixel: depth {n, 1, h, w} (0 = none), normal {n, 3} and albedo {n, 3}, material {n, 2 or more} (roughness, metallic),
// camera {n, 4, 1, 1}. Rays {1, C, pixels, samples} (kernels/lib/chunk.clh): direction 3, camera frame, unit, (0, 0, 0)
// where there is none; weight 3 = f cos / pdf; pdf 1, 1/sr, of the whole mixture, 0 where there is no direction.
// The directions, pdf and lobe probabilities come from the sampling maps and are detached; weights are those of the
// evaluation maps (DETACHED), or of the same maps, and then in the form of kernels/lib/ggx.clh in which D cancels.
// With LOBES the weight comes in two parts, weight (1 - specular) of the Lambertian and weight * specular of the lobe:
// specular 3, its share of f, and lobe 1, 1/sr, the density of the lobe itself at that direction. Both are of the
// evaluation maps and the direction alone, whoever draws it.
// status {1, 1, pixels, 1}: 0 shaded, 1 no depth, 2 the normal faces away from the viewer (n.v <= 0) or
// is not a number.
//
// GUIDED: some directions are drawn towards lamps, by the pixels' rows guide {pixels, C, 1, 1} (lib/guide.clh), the others
// by SAMPLER; whoever drew it, a direction has the density of both together (the one-sample balance heuristic of Veach
// and Guibas 1995).
// SAMPLER: as in ggx.clh, or 6: the 8 x 16 grid of Li et al. 2020, sample = direction. SOBOL: points by Owen-scrambled
// Sobol, else independent. LI2020: their surface model instead of ours.
//
// Samples of a pixel go side by side (lib/lanes.clh, lib/packet.clh): what they share is found once for all. Contracted
// sums would not be the same in a vector as alone.
#include "lib/lanes.clh"
#define PACKET LANES
#pragma OPENCL FP_CONTRACT OFF
#include "lib/camera.clh"
#include "lib/chunk.clh"
#include "lib/ggx.clh"
#include "lib/guide.clh"
#include "lib/li2020.clh"
#include "lib/rng.clh"
#include "lib/surface.clh"
#include "lib/view.clh"

#define SAMPLER_GRID 6
#ifndef SAMPLER
#define SAMPLER SAMPLER_VNDF_CAPS
#endif

static inline Parts f_times_cosine(Material m, real3 wo, Drawn in) {
#ifdef LI2020
  return li2020_times_cosine(m, wo, in.wi);
#else
  return parts_times_cosine(m, wo, in);
#endif
}

// What all rays of a pixel share. Vectors in the local frames of the sampling and of the evaluation maps.
typedef struct {
  int status;
  uint row;                  // of the batch: whose random numbers
  global const real *guide;  // the pixel's row, or 0: no lamps are known
  real aimed;                // share of directions drawn towards lamps
  Frame frame;
  real3 raw, wo;  // raw: the normal as in its map, over unit_near()
  Material material;
  real alpha, chance;
  // Of the evaluation maps.
  Frame e_frame;
  real3 e_normal, e_wo;
  real e_unit;  // unit_near() of the normal
  Material e_material;
} Pixel;

// Rays as the kernel and its adjoint see them: the same random numbers, and the same bits of the direction in the frame of
// the surface that is evaluated. A direction that went through the camera's frame comes back good to 6e-8 alone.
typedef struct {
  ints drawn;      // there is a direction
  reals3 towards;  // camera frame
  reals density;   // of the sampling, 1/sr
  Drawn in;        // in the frame of the evaluation maps
  Parts weight;    // f cos / density
} Samples;

static inline reals3 rays_to_world(const Frame f, const reals3 v) {
  return SUM3(SUM3(TIMES3(v.x, f.t), TIMES3(v.y, f.b)), TIMES3(v.z, f.n));
}
static inline reals3 rays_to_local(const Frame f, const reals3 v) {
  return reals3_of(DOT3(f.t, v), DOT3(f.b, v), DOT3(f.n, v));
}

// Vectors of the local frame around one normal in that around another; both as in their maps, of any length. What one
// normal is along the other's tangents comes from their difference, in which what they share is gone: tangential parts
// as small as a narrow lobe's keep their digits.
static inline reals3 in_other_frame(const Frame from, const real3 from_normal, const Frame to, const real3 to_normal,
                                    const reals3 v) {
  const real size = sqrt(dot3(from_normal, from_normal)), to_size = sqrt(dot3(to_normal, to_normal));
  const real ratio = to_size > R(0) ? size / to_size : R(1);
  const real3 lean = fma((real3)(-ratio), to_normal, from_normal) / (size > R(0) ? size : R(1));
  const reals3 across = SUM3(TIMES3(v.x, from.t), TIMES3(v.y, from.b)), whole = SUM3(across, TIMES3(v.z, lean));
  return reals3_of(DOT3(to.t, whole), DOT3(to.b, whole), v.z * dot3(from.n, to.n) - DOT3(across, lean));
}

// Maps of one picture.
typedef struct {
  global const real *normal, *albedo, *material;
} Maps;

static inline Pixel pixel_of(global const real *depth, const Camera camera, const Maps drawing, const Maps evaluated,
                             global const real *guide, const int w, const int plane, const int pixel, const uint row) {
  const int j = pixel / w;
  const real column = (real)(pixel - j * w) + R(0.5), line = (real)j + R(0.5);
  const real3 ray = unproject(camera, column, line), rest = unproject_rest(camera, column, line);
  const real3 view = -unit3(ray);
  const real3 mapped = rgb_at(drawing.normal, plane, pixel);
  const real unit = unit_near(mapped);
  Pixel at;
  at.row = row, at.guide = guide;
  at.aimed = guide ? guide_chance(guide) : R(0);
  at.raw = mapped / unit;
  at.material = material_at(drawing.albedo, drawing.material, plane, pixel);
#if SAMPLER == SAMPLER_GRID
  at.frame = grid_frame(unit3(at.raw));
  at.wo = to_local(at.frame, view);
#else
  at.frame = frame_of(unit3(at.raw));
  at.wo = local_view(at.frame, at.raw, ray, rest);
  at.chance = specular_probability(at.material, at.wo);
#endif
  at.alpha = alpha_of(at.material.roughness);
  // Of both cosines: wo.z is the exact one, but not of a normal without length.
  at.status = is_depth(depth[pixel]) ? (dot3(at.raw, view) > R(0) && !(at.wo.z <= R(0)) ? 0 : 2) : 1;
#ifdef DETACHED
  at.e_normal = rgb_at(evaluated.normal, plane, pixel);
  at.e_unit = unit_near(at.e_normal);
  at.e_normal /= at.e_unit;
  at.e_frame = frame_of(unit3(at.e_normal));
  at.e_material = material_at(evaluated.albedo, evaluated.material, plane, pixel);
  at.e_wo = local_view(at.e_frame, at.e_normal, ray, rest);
#else
  at.e_normal = at.raw, at.e_unit = unit, at.e_frame = at.frame, at.e_material = at.material, at.e_wo = at.wo;
#endif
  return at;
}

static inline Samples samples_of(const Pixel at, const uints index, const uint seed) {
  Samples rays;
#if SAMPLER == SAMPLER_GRID
  const Drawn in = drawn_of(at.wo, grid_direction(AS_INTS(index)));
  rays.density = grid_pdf(AS_INTS(index));
#else
#ifdef SOBOL
  const reals4 u = sobol_point4(seed ^ SALT, at.row, index, 0u);
#else
  const reals4 u = random4(seed ^ SALT, at.row, index, 0u);
#endif
#ifdef GUIDED
  const reals which = (u.z - at.aimed) / (R(1) - at.aimed);
#else
  const reals which = u.z;
#endif
  Drawn in = draw_direction(SAMPLER, at.wo, at.alpha, at.chance, reals3_of(u.x, u.y, which));
#ifdef GUIDED
  const ints guided = IS(u.z < at.aimed);
  if (any_of(guided)) {
    const reals3 lit = guided_direction(at.guide, reals3_of(u.x, u.y, u.z));
    in = pick_drawn(guided, drawn_of(at.wo, rays_to_local(at.frame, lit)), in);
  }
#endif
  const reals by_surface = drawn_pdf(SAMPLER, at.wo, in, at.alpha, at.chance);
  rays.density = by_surface;
#endif
  // Not wi.z > 0: a direction that is not a number is handed on, to be dropped and counted where samples are summed.
  rays.drawn = at.status == 0 ? ~IS(in.wi.z <= R(0)) : 0;
  rays.towards = rays_to_world(at.frame, in.wi);
#ifdef GUIDED
  rays.density = (R(1) - at.aimed) * by_surface + guide_density(at.guide, rays.towards);
#endif

#ifdef DETACHED
  rays.in.wi = in_other_frame(at.frame, at.raw, at.e_frame, at.e_normal, in.wi);
  rays.in.h = in_other_frame(at.frame, at.raw, at.e_frame, at.e_normal, in.h);
#else
  rays.in = in;
#endif
#if defined(DETACHED) || SAMPLER == SAMPLER_GRID || defined(LI2020)
  rays.weight = scaled(R(1) / rays.density, f_times_cosine(at.e_material, at.e_wo, rays.in));
#else
  rays.weight = drawn_weight(SAMPLER, at.material, at.wo, in, at.chance);
#ifdef GUIDED
  rays.weight = scaled(PICK(rays.drawn, by_surface / rays.density, R(0)), rays.weight);
#endif
#endif
  return rays;
}

#ifdef GUIDED
#define GUIDE_ARG , IN(guide)
#define GUIDE_ROW AT(guide, p)
#else
#define GUIDE_ARG
#define GUIDE_ROW 0
#endif
#ifdef DETACHED
#define MAP_ARGS \
  IN(depth), IN(camera), IN(normal), IN(albedo), IN(material), IN(e_normal), IN(e_albedo), IN(e_material) GUIDE_ARG
#define EVALUATED (Maps){AT(e_normal, n), AT(e_albedo, n), AT(e_material, n)}
#else
#define MAP_ARGS IN(depth), IN(camera), IN(normal), IN(albedo), IN(material) GUIDE_ARG
#define EVALUATED DRAWING
#endif
#define DRAWING (Maps){AT(normal, n), AT(albedo, n), AT(material, n)}

// What a row of samples shares: of picture n, `pixel` of its plane.
#define PIXEL_OF_ROW(p)                                                                                      \
  const int plane = w * h, n = (first_pixel + p) / plane;                                                    \
  const Pixel at = pixel_of(AT(depth, n), camera_at(AT(camera, n)), DRAWING, EVALUATED, GUIDE_ROW, w, plane, \
                            first_pixel + p - n * plane, (uint)(first_pixel + p));
// The samples s, s + 1, ... and whether they are of the chunk.
#define RAYS_OF_ROW(s)                                                              \
  const Samples rays = samples_of(at, AS_UINTS(first_sample + s + OWN_LANE), seed); \
  const ints inside = IS(s + OWN_LANE < samples);

// Work-items along x share the samples of row y.
kernel void sample_brdf(MAP_ARGS, OUT(direction), OUT(weight), OUT(pdf), OUT(status),
#ifdef LOBES
                        OUT(specular), OUT(lobe),
#endif
                        CHUNK_ARGS, const int w, const int h, const uint seed) {
  const int p = (int)get_global_id(1), begin = PACKET * (int)get_global_id(0);
  if (p >= pixels) return;
  PIXEL_OF_ROW(p)
  if (begin == 0) AT(status, 0)[p] = first_sample > 0 ? R(0) : (real)at.status;
  for (int s = begin; s < sample_capacity; s += PACKET * (int)get_global_size(0)) {
    RAYS_OF_ROW(s)
    const ulong ray = RAY(p, s);
    const ints valid = rays.drawn & inside;
    store3(pick3(valid, rays.towards, none3()), AT(direction, 0) + ray, RAY_PLANE);
    store3(pick3(valid, whole(rays.weight), none3()), AT(weight, 0) + ray, RAY_PLANE);
    STORE(PICK(valid, rays.density, R(0)), AT(pdf, 0) + ray);
#ifdef LOBES
    const reals density = lobe_density(at.e_wo, rays.in, alpha_of(at.e_material.roughness));
    store3(pick3(valid, specular_share(rays.weight), none3()), AT(specular, 0) + ray, RAY_PLANE);
    STORE(PICK(valid, density, R(0)), AT(lobe, 0) + ray);
#endif
  }
}

// Detached adjoint: what the weights of rays give to the evaluation maps, as f cos of fixed directions over a fixed pdf;
// with LOBES what the lobe's share and density give, too. A work-group takes the row of a pixel.
// d_surface {1, 8, pixels, 1}, 0 beyond the chunk: normal 3 (of the map as it is, of any length), albedo 3, roughness,
// metallic. With S = cos_i t(cos_o) + cos_o t(cos_i), V = 1 / (2 S) and k from D = k^2 / pi
// (lib/ggx.clh):  dV = -2 V^2 dS,  dk/dh.z = 2 alpha |h|^2 h.z (1 - alpha^2) / q^2,
// dk/dalpha = |h|^2 (h.x^2 + h.y^2 - alpha^2 h.z^2) / q^2,  q = h.x^2 + h.y^2 + alpha^2 h.z^2.
// Share s / (s + d) of the parts s and d of f: ds (1 - share) / (s + d) - dd share / (s + d).
// The lobe's density D m with m = 1 / (2 (cos_o + t(cos_o))): dm = -2 m^2 (dcos_o + dt).
kernel void sample_brdf_adjoint(MAP_ARGS, IN(d_weight),
#ifdef LOBES
                                IN(d_specular), IN(d_lobe),
#endif
                                OUT(d_surface), CHUNK_ARGS, const int w, const int h, const uint seed) {
  const int row = (int)get_group_id(0), p = min(row, pixels - 1);
  GROUP_SCRATCH(scratch);
  PIXEL_OF_ROW(p)
  const Material m = at.e_material;
  const real3 wo = at.e_wo, f0 = specular_f0(m), albedo = diffuse_albedo(m);
  const real alpha = alpha_of(m.roughness), a2 = alpha * alpha;
  const real to = SMITH_T(wo.z, alpha), to_co = wo.z * (R(1) - a2) / to, to_alpha = alpha * (R(1) - wo.z * wo.z) / to;
  const int seen = row < pixels && at.status == 0 && wo.z > R(0);

  // Sums of what is not the same for all: the normal's along two tangents, Lambertian and F0 by channel, and alpha.
  lanes across_x = R(0), across_y = R(0), by_alpha = R(0);
  reals3 by_diffuse = none3(), by_f0 = none3();
  FOR_ROW(s, seen ? samples : 0) {
    RAYS_OF_ROW(s)
    const ulong ray = RAY(p, s);
    const reals3 wi = rays.in.wi, half_way = rays.in.h;
    const reals3 arriving = load3(AT(d_weight, 0) + ray, RAY_PLANE);
    reals asked = fabs(arriving.x) + fabs(arriving.y) + fabs(arriving.z);
#ifdef LOBES
    const reals3 to_share = load3(AT(d_specular, 0) + ray, RAY_PLANE);
    const reals to_density = LOAD(AT(d_lobe, 0) + ray);
    asked += fabs(to_share.x) + fabs(to_share.y) + fabs(to_share.z) + fabs(to_density);
#endif
    const ints not_asked = IS(asked <= R(0));  // NaN is asked for
    const ints valid = inside & rays.drawn & IS(rays.density > R(0)) & IS(wi.z > R(0)) & ~not_asked;

    const reals across = half_way.x * half_way.x + half_way.y * half_way.y, hz = half_way.z, h2 = across + hz * hz;
    const reals q = R(1) / (across + a2 * hz * hz);
    const reals k = alpha * h2 * q, dist = k * k * INV_PI;
    const reals dist_k = R(2) * k * INV_PI;
    const reals dist_hz = dist_k * R(2) * k * hz * (R(1) - a2) * q;
    const reals dist_alpha = dist_k * (h2 * q) * ((across - a2 * hz * hz) * q);

    const reals ti = SMITH_T(wi.z, alpha), over_ti = R(1) / ti;
    const reals v = smith_v(wi.z, wo.z, alpha), v_s = R(-2) * v * v;
    const reals v_ci = v_s * (to + wo.z * (wi.z * (R(1) - a2) * over_ti));
    const reals v_co = v_s * (ti + wi.z * to_co);
    const reals v_alpha = v_s * (wi.z * to_alpha + wo.z * (alpha * (R(1) - wi.z * wi.z) * over_ti));

    // To the two parts of f cos.
    const reals over_density = R(1) / rays.density;
    const reals3 g = TIMES3(over_density, arriving);
#ifdef LOBES
    const reals3 share = specular_share(rays.weight), all = whole(rays.weight);
    const reals3 taken = TIMES3(over_density, reals3_of(share_of(to_share.x, all.x), share_of(to_share.y, all.y),
                                                        share_of(to_share.z, all.z)));
    const reals3 rest = reals3_of(R(1) - share.x, R(1) - share.y, R(1) - share.z);
    const reals3 g_specular = reals3_of(g.x + taken.x * rest.x, g.y + taken.y * rest.y, g.z + taken.z * rest.z);
    const reals3 g_diffuse = reals3_of(g.x - taken.x * share.x, g.y - taken.y * share.y, g.z - taken.z * share.z);
#else
    const reals3 g_specular = g, g_diffuse = g;
#endif
    const reals lobe = dist * v * wi.z, lambert = wi.z * INV_PI;
    const reals3 fresnel = schlick(f0, fresnel_share(wo, wi));
    const reals to_lobe = DOT3(g_specular, fresnel);
    const reals d_ci = DOT3(g_diffuse, albedo) * INV_PI + to_lobe * dist * (v + wi.z * v_ci);
    reals d_co = to_lobe * dist * wi.z * v_co;
    reals d_hz = to_lobe * v * wi.z * dist_hz;
    reals d_alpha = to_lobe * wi.z * (dist_alpha * v + dist * v_alpha);
#ifdef LOBES
    const reals masking = specular_factor(SAMPLER_VNDF_CAPS, wo, half_way, alpha);
    const reals masking_s = R(-2) * masking * masking;
    d_co += to_density * dist * masking_s * (R(1) + to_co);
    d_hz += to_density * dist_hz * masking;
    d_alpha += to_density * (dist_alpha * masking + dist * masking_s * to_alpha);
#endif

    // Along the normal nothing changes but its length.
    across_x += PICK(valid, d_ci * wi.x + d_co * wo.x + d_hz * half_way.x, R(0));
    across_y += PICK(valid, d_ci * wi.y + d_co * wo.y + d_hz * half_way.y, R(0));
    by_alpha += PICK(valid, d_alpha, R(0));
    by_diffuse = SUM3(by_diffuse, pick3(valid, TIMES3(lambert, g_diffuse), none3()));
    by_f0 = SUM3(by_f0, pick3(valid, TIMES3(fresnel_rest(half_way) * lobe, g_specular), none3()));
  }
  const real3 turned = (real3)(group_sum(across_x, scratch), group_sum(across_y, scratch), R(0));
  const real d_alpha = group_sum(by_alpha, scratch);
  const real3 d_diffuse = (real3)(group_sum(by_diffuse.x, scratch), group_sum(by_diffuse.y, scratch),
                                  group_sum(by_diffuse.z, scratch));
  const real3 d_f0 = (real3)(group_sum(by_f0.x, scratch), group_sum(by_f0.y, scratch), group_sum(by_f0.z, scratch));
  if (get_local_id(0) > 0) return;

  const real length = at.e_unit * sqrt(dot3(at.e_normal, at.e_normal));
  const real3 d_normal = to_world(at.e_frame, turned) / (length > R(0) ? length : R(1));
  const real3 d_albedo = d_diffuse * (R(1) - m.metallic) + d_f0 * m.metallic;
  const real d_roughness = alpha > R(1e-4) ? R(2) * m.roughness * d_alpha : R(0);
  const real d_metallic = dot3(d_f0, m.albedo - R(0.04)) - dot3(d_diffuse, m.albedo);
  const real values[8] = {d_normal.x, d_normal.y, d_normal.z,  d_albedo.x,
                          d_albedo.y, d_albedo.z, d_roughness, d_metallic};
  for (int c = 0; c < 8; ++c) AT(d_surface, 0)[c * pixel_capacity + row] = seen ? values[c] : R(0);
}
