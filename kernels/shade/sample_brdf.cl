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
#ifndef EACH
#define EACH 1
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

// A ray as the kernel and its adjoint see it: the same random numbers, and the same bits of the direction in the frame of
// the surface that is evaluated. A direction that went through the camera's frame comes back good to 6e-8 alone.
typedef struct {
  int drawn;      // there is a direction
  real3 towards;  // camera frame
  real density;   // of the sampling, 1/sr
  Drawn in;       // in the frame of the evaluation maps
  Parts weight;   // f cos / density
} Sample;

// A vector of the local frame around one normal in that around another; both as in their maps, of any length. What one
// normal is along the other's tangents comes from their difference, in which what they share is gone: tangential parts
// as small as a narrow lobe's keep their digits.
static inline real3 in_other_frame(const Frame from, const real3 from_normal, const Frame to, const real3 to_normal,
                                   const real3 v) {
  const real size = sqrt(dot3(from_normal, from_normal)), to_size = sqrt(dot3(to_normal, to_normal));
  const real ratio = to_size > R(0) ? size / to_size : R(1);
  const real3 lean = fma((real3)(-ratio), to_normal, from_normal) / (size > R(0) ? size : R(1));
  const real3 across = v.x * from.t + v.y * from.b, whole = across + v.z * lean;
  return (real3)(dot3(to.t, whole), dot3(to.b, whole), v.z * dot3(from.n, to.n) - dot3(across, lean));
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
  at.status = depth[pixel] > R(0) ? (dot3(at.raw, view) > R(0) && !(at.wo.z <= R(0)) ? 0 : 2) : 1;
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

static inline Sample sample_of(const Pixel at, const uint index, const uint seed) {
  Sample sample;
#if SAMPLER == SAMPLER_GRID
  const Drawn in = drawn_of(at.wo, grid_direction((int)index));
  sample.density = grid_pdf((int)index);
#else
#ifdef SOBOL
  const real4 u = sobol_point4(seed ^ SALT, at.row, index, 0u);
#else
  const real4 u = random4(seed ^ SALT, at.row, index, 0u);
#endif
  const real3 rest_of_u = (real3)(u.xy, at.guide ? (u.z - at.aimed) / (R(1) - at.aimed) : u.z);
  Drawn in = draw_direction(SAMPLER, at.wo, at.alpha, at.chance, rest_of_u);
  if (at.guide && u.z < at.aimed)
    in = drawn_of(at.wo, to_local(at.frame, guided_direction(at.guide, u.xyz)));
  const real by_surface = drawn_pdf(SAMPLER, at.wo, in, at.alpha, at.chance);
  sample.density = by_surface;
#endif
  // Not wi.z > 0: a direction that is not a number is handed on, to be dropped and counted where samples are summed.
  sample.drawn = at.status == 0 && !(in.wi.z <= R(0));
  sample.towards = to_world(at.frame, in.wi);
#ifdef GUIDED
  sample.density = (R(1) - at.aimed) * by_surface + guide_density(at.guide, sample.towards);
#endif

#ifdef DETACHED
  sample.in.wi = in_other_frame(at.frame, at.raw, at.e_frame, at.e_normal, in.wi);
  sample.in.h = in_other_frame(at.frame, at.raw, at.e_frame, at.e_normal, in.h);
#else
  sample.in = in;
#endif
#if defined(DETACHED) || SAMPLER == SAMPLER_GRID || defined(LI2020)
  sample.weight = f_times_cosine(at.e_material, at.e_wo, sample.in);
  sample.weight.diffuse /= sample.density, sample.weight.specular /= sample.density;
#else
  sample.weight = drawn_weight(SAMPLER, at.material, at.wo, in, at.chance);
#ifdef GUIDED
  const real balance = sample.drawn ? by_surface / sample.density : R(0);
  sample.weight.diffuse *= balance, sample.weight.specular *= balance;
#endif
#endif
  return sample;
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

// A work-item takes EACH samples of a pixel: of picture n, `pixel` of its plane.
#define RAYS_OF_WORK_ITEM                                                                                         \
  const int begin = EACH * (int)get_global_id(0);                                                                 \
  const int p = (int)get_global_id(1);                                                                            \
  if (begin >= sample_capacity || p >= pixels) return;                                                            \
  const int plane = w * h;                                                                                        \
  const int n = (first_pixel + p) / plane;                                                                        \
  const Pixel at = pixel_of(AT(depth, n), camera_at(AT(camera, n)), DRAWING, EVALUATED, GUIDE_ROW, w, plane,      \
                            first_pixel + p - n * plane, (uint)(first_pixel + p));                                \
  const int end = min(begin + EACH, sample_capacity);
#define RAY_OF_SAMPLE           \
  const ulong ray = RAY(p, s); \
  const Sample sample = sample_of(at, (uint)(first_sample + s), seed);

static inline void store3(real3 v, global real *to, ulong step) { to[0] = v.x, to[step] = v.y, to[2 * step] = v.z; }
static inline real3 load3(global const real *from, ulong step) {
  return (real3)(from[0], from[step], from[2 * step]);
}

kernel void sample_brdf(MAP_ARGS, OUT(direction), OUT(weight), OUT(pdf), OUT(status),
#ifdef LOBES
                        OUT(specular), OUT(lobe),
#endif
                        CHUNK_ARGS, const int w, const int h, const uint seed) {
  RAYS_OF_WORK_ITEM
  if (begin == 0) AT(status, 0)[p] = first_sample > 0 ? R(0) : (real)at.status;
  for (int s = begin; s < end; ++s) {
    RAY_OF_SAMPLE
    const int valid = sample.drawn && s < samples;
    const real3 none = (real3)(R(0));
    store3(valid ? sample.towards : none, AT(direction, 0) + ray, RAY_PLANE);
    store3(valid ? whole(sample.weight) : none, AT(weight, 0) + ray, RAY_PLANE);
    AT(pdf, 0)[ray] = valid ? sample.density : R(0);
#ifdef LOBES
    store3(valid ? specular_share(sample.weight) : none, AT(specular, 0) + ray, RAY_PLANE);
    AT(lobe, 0)[ray] = valid ? lobe_density(at.e_wo, sample.in, alpha_of(at.e_material.roughness)) : R(0);
#endif
  }
}

// Detached adjoint: what the weights of rays give to the evaluation maps, as f cos of fixed directions over a fixed pdf;
// with LOBES what the lobe's share and density give, too.
// d_surface {1, 8, pixels, samples}: normal 3 (of the map as it is, of any length), albedo 3, roughness, metallic; 0
// where there is no direction. With S = cos_i t(cos_o) + cos_o t(cos_i), V = 1 / (2 S) and k from D = k^2 / pi
// (lib/ggx.clh):  dV = -2 V^2 dS,  dk/dh.z = 2 alpha |h|^2 h.z (1 - alpha^2) / q^2,
// dk/dalpha = |h|^2 (h.x^2 + h.y^2 - alpha^2 h.z^2) / q^2,  q = h.x^2 + h.y^2 + alpha^2 h.z^2.
// Share s / (s + d) of the parts s and d of f: ds (1 - share) / (s + d) - dd share / (s + d).
// The lobe's density D m with m = 1 / (2 (cos_o + t(cos_o))): dm = -2 m^2 (dcos_o + dt).
kernel void sample_brdf_adjoint(MAP_ARGS, IN(d_weight),
#ifdef LOBES
                                IN(d_specular), IN(d_lobe),
#endif
                                OUT(d_surface), CHUNK_ARGS, const int w, const int h, const uint seed) {
  RAYS_OF_WORK_ITEM
  for (int s = begin; s < end; ++s) {
    RAY_OF_SAMPLE
    const Material m = at.e_material;
    const real3 wo = at.e_wo, wi = sample.in.wi, half_way = sample.in.h;
    const real3 arriving = load3(AT(d_weight, 0) + ray, RAY_PLANE);
    real asked = fabs(arriving.x) + fabs(arriving.y) + fabs(arriving.z);
#ifdef LOBES
    const real3 to_share = load3(AT(d_specular, 0) + ray, RAY_PLANE);
    const real to_density = AT(d_lobe, 0)[ray];
    asked += fabs(to_share.x) + fabs(to_share.y) + fabs(to_share.z) + fabs(to_density);
#endif
    const int valid =
        s < samples && sample.drawn && sample.density > R(0) && wi.z > R(0) && wo.z > R(0) && asked > R(0);

    const real alpha = alpha_of(m.roughness), a2 = alpha * alpha;
    const real across = half_way.x * half_way.x + half_way.y * half_way.y, hz = half_way.z, h2 = across + hz * hz;
    const real q = across + a2 * hz * hz;
    const real k = alpha * h2 / q, dist = k * k * INV_PI;
    const real dist_k = R(2) * k * INV_PI;
    const real dist_hz = dist_k * R(2) * k * hz * (R(1) - a2) / q;
    const real dist_alpha = dist_k * (h2 / q) * ((across - a2 * hz * hz) / q);

    const real ti = smith_t(wi.z, alpha), to = smith_t(wo.z, alpha);
    const real to_co = wo.z * (R(1) - a2) / to, to_alpha = alpha * (R(1) - wo.z * wo.z) / to;
    const real v = smith_v(wi.z, wo.z, alpha), v_s = R(-2) * v * v;
    const real v_ci = v_s * (to + wo.z * (wi.z * (R(1) - a2) / ti));
    const real v_co = v_s * (ti + wi.z * to_co);
    const real v_alpha = v_s * (wi.z * to_alpha + wo.z * (alpha * (R(1) - wi.z * wi.z) / ti));

    // To the two parts of f cos.
    const real3 g = arriving / sample.density;
#ifdef LOBES
    const real3 share = specular_share(sample.weight), all = whole(sample.weight) * sample.density;
    const real3 by_share = select((real3)(R(0)), to_share / all, all != R(0));
    const real3 g_specular = g + by_share * (R(1) - share), g_diffuse = g - by_share * share;
#else
    const real3 g_specular = g, g_diffuse = g;
#endif
    const real3 fresnel = schlick(specular_f0(m), fresnel_share(wo, wi));
    const real lobe = dist * v * wi.z, lambert = wi.z * INV_PI;
    const real to_lobe = dot3(g_specular, fresnel);
    const real d_ci = dot3(g_diffuse, diffuse_albedo(m)) * INV_PI + to_lobe * dist * (v + wi.z * v_ci);
    real d_co = to_lobe * dist * wi.z * v_co;
    real d_hz = to_lobe * v * wi.z * dist_hz;
    real d_alpha = to_lobe * wi.z * (dist_alpha * v + dist * v_alpha);
#ifdef LOBES
    const real masking = specular_factor(SAMPLER_VNDF_CAPS, wo, half_way, alpha), masking_s = R(-2) * masking * masking;
    d_co += to_density * dist * masking_s * (R(1) + to_co);
    d_hz += to_density * dist_hz * masking;
    d_alpha += to_density * (dist_alpha * masking + dist * masking_s * to_alpha);
#endif

    // Along the normal nothing changes but its length.
    const real3 turned = d_ci * wi + d_co * wo + d_hz * half_way;
    const real length = at.e_unit * sqrt(dot3(at.e_normal, at.e_normal));
    const real3 d_normal = to_world(at.e_frame, (real3)(turned.x, turned.y, R(0))) / (length > R(0) ? length : R(1));
    const real3 d_f0 = g_specular * (fresnel_rest(half_way) * lobe);
    const real3 d_albedo = g_diffuse * ((R(1) - m.metallic) * lambert) + d_f0 * m.metallic;
    const real d_roughness = alpha > R(1e-4) ? R(2) * m.roughness * d_alpha : R(0);
    const real d_metallic = dot3(d_f0, m.albedo - R(0.04)) - dot3(g_diffuse, m.albedo) * lambert;

    const real values[8] = {d_normal.x, d_normal.y, d_normal.z,  d_albedo.x,
                            d_albedo.y, d_albedo.z, d_roughness, d_metallic};
    for (int c = 0; c < 8; ++c) AT(d_surface, 0)[c * RAY_PLANE + ray] = valid ? values[c] : R(0);
  }
}
