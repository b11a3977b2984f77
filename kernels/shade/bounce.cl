// The next direction of rays that hit inserted objects, and what light from there is worth.
//
// Rays {1, C, pixels, samples} (kernels/lib/chunk.clh): direction 3, travelling towards the object; normal 3, unit, of the
// object on the ray's side; object: row of materials {objects, 5, 1, 1} = albedo, roughness, metallic, or -1: no object.
// Results: next 3, unit, camera frame, (0, 0, 0) where there is no object or the sample fell below the surface;
// weight 3 = f cos / pdf of the mixture of visible normals and cosine (kernels/lib/ggx.clh), 0 there.
// With LOBES also how the whole path so far sees light from there (host/ops/light/rays.hpp): specular 3, the share of its
// weight that met nothing but specular lobes, that of the arriving ray times this surface's; widest 1, the density
// (1/sr) of the widest of these lobes, the smaller of the arriving ray's `lobe` and this surface's.
// Random numbers: (seed, pixel, sample, block), block = number of the bounce. Detached.
#include "lib/chunk.clh"
#include "lib/ggx.clh"
#include "lib/rng.clh"

#define SALT 0x626f756eu

kernel void bounce(IN(direction), IN(normal), IN_INT(object), IN(materials),
#ifdef LOBES
                   IN(arriving), IN(lobe),
#endif
                   OUT(next), OUT(weight),
#ifdef LOBES
                   OUT(specular), OUT(widest),
#endif
                   CHUNK_ARGS, const int objects, const uint seed, const uint block) {
  RAY_OF_WORK_ITEM
  const ulong step = RAY_PLANE;
  const int met = AT(object, 0)[ray];
  global real *to = AT(next, 0) + ray, *w = AT(weight, 0) + ray;
  if (met < 0) {  // nearly all rays of a picture
    to[0] = to[step] = to[2 * step] = w[0] = w[step] = w[2 * step] = R(0);
#ifdef LOBES
    for (int c = 0; c < 3; ++c) AT(specular, 0)[c * step + ray] = R(0);
    AT(widest, 0)[ray] = R(0);
#endif
    return;
  }
  global const real *d = AT(direction, 0) + ray, *n = AT(normal, 0) + ray, *m = AT(materials, min(met, objects - 1));
  Material material;
  material.albedo = (real3)(m[0], m[1], m[2]);
  material.roughness = m[3], material.metallic = m[4];

  const Frame frame = frame_of(unit3((real3)(n[0], n[step], n[2 * step])));
  const real3 wo = to_local(frame, -unit3((real3)(d[0], d[step], d[2 * step])));
  const real alpha = alpha_of(material.roughness);
  const real chance = specular_probability(material, wo);
  const real4 u = random4(seed ^ SALT, (uint)(first_pixel + p), (uint)(first_sample + s), block);
  const Drawn in = draw_direction(SAMPLER_VNDF_CAPS, wo, alpha, chance, u.xyz);
  const int valid = s < samples && wo.z > R(0) && in.wi.z > R(0);
  const real3 towards = valid ? to_world(frame, in.wi) : (real3)(R(0));
  const Parts parts = drawn_weight(SAMPLER_VNDF_CAPS, material, wo, in, chance);
  const real3 worth = valid ? whole(parts) : (real3)(R(0));
  to[0] = towards.x, to[step] = towards.y, to[2 * step] = towards.z;
  w[0] = worth.x, w[step] = worth.y, w[2 * step] = worth.z;
#ifdef LOBES
  global const real *before = AT(arriving, 0) + ray;
  global real *share = AT(specular, 0) + ray;
  const real3 here = valid ? specular_share(parts) : (real3)(R(0));
  share[0] = before[0] * here.x, share[step] = before[step] * here.y, share[2 * step] = before[2 * step] * here.z;
  AT(widest, 0)[ray] = valid ? fmin(AT(lobe, 0)[ray], lobe_density(wo, in, alpha)) : R(0);
#endif
}
