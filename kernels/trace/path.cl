// The path tracer: maps of what a camera sees, and radiance that arrives along rays.
//
// Unidirectional paths with next-event estimation: at every vertex a point on an emitter (a triangle by its power, then
// uniform by area; for panes also a direction by the brightness of the sky behind them; several points where the path
// first lands) and one direction of the surface model, joined by the balance heuristic (Veach and Guibas 1995).
// Russian roulette from the third vertex on keeps the estimate unbiased. A window pane is an emitter whose radiance
// depends on the direction. Primary rays run through pixel centres, every sample of a pixel alike: the re-rendering
// layer shades one point per pixel, and this is the picture it must equal.
// Random numbers: block BLOCKS * vertex chooses direction and survival, the following ones the points on lights.
// Frames: world space, metres; maps in camera space. One work-item traces one ray or pixel.
#include "lib/camera.clh"
#include "trace/scene.clh"

// Rays start this far off the surface, and end this share short of a light.
#define OFFSET R(1e-4)
#define FAR R(1e30)
#define SURVIVAL_MOST R(0.95)
#define BLOCKS 16

typedef struct {
  uint seed, pixel, sample;
} Key;

typedef struct {
  int with_emission;   // whether an emitter hit first counts
  int light_samples;   // where the path first lands
  int max_depth;       // most scatterings
  real spread;         // width of a pixel one metre along the first ray; 0: a point
  real most_indirect;  // most that one contribution by way of other surfaces may add; Inf keeps the estimate unbiased
} PathOptions;

// Density by solid angle of choosing the point of an emitter that lies along unit d, at squared distance d2 and seen
// under cosine c: by area, and for panes by the sky's direction too.
static inline real light_pdf(const Scene *s, int emitter, real d2, real c, real3 d) {
  global const real *e = s->emitters + emitter * EMITTER_SIZE;
  const real by_area = (R(1) - s->sky_share) * e[4] * d2 / c;
  return e[3] != R(0) && s->sky_share > R(0) ? by_area + s->sky_share * sky_pdf(s, d) : by_area;
}

typedef struct {
  real3 wi;       // unit, world
  real distance;  // 0: nothing was found
  real cosine;    // at the light
  int emitter;
} LightSample;

// A point on a light, by power and area.
static LightSample sample_area(const Scene *s, real3 start, real3 u) {
  LightSample sample;
  real which = u.x;
  global const real *light = s->lights + pick_from(s->light_cdf, s->light_count, &which) * LIGHT_SIZE;
  const real root = sqrt(u.y), a = root * (R(1) - u.z), b = root * u.z;
  const real3 to = (real3)(light[0] + a * light[3] + b * light[6], light[1] + a * light[4] + b * light[7],
                           light[2] + a * light[5] + b * light[8]) - start;
  sample.distance = sqrt(dot3(to, to));
  sample.wi = to / fmax(sample.distance, OFFSET);
  sample.cosine = -dot3((real3)(light[9], light[10], light[11]), sample.wi);
  sample.emitter = (int)light[12];
  return sample;
}

// The pane through which a bright part of the sky is seen, if there is one along that direction.
static LightSample sample_through_panes(const Scene *s, real3 start, real u, real v) {
  LightSample sample;
  sample.wi = sample_sky(s, u, v);
  sample.distance = R(0);
  const BvhRay ray = bvh_ray(start, sample.wi);
  real nearest = FAR;
  for (int leaf = s->pane_leaf; leaf < s->pane_leaf + s->pane_leaves; ++leaf) {
    wide t, a, b;
    uint lanes = meet_triangles(&s->bvh, leaf, &ray, R(0), nearest, &t, &a, &b);
    if (!lanes) continue;
    for (; lanes; lanes &= lanes - 1) {
      const int lane = lowest_lane(lanes);
      const real distance = lane_of(t, lane);
      if (distance >= nearest) continue;
      nearest = distance;
      global const real *surface = s->surfaces + s->bvh.triangles[leaf * BVH_WIDTH + lane] * SURFACE_SIZE;
      sample.distance = nearest;
      sample.cosine = -dot3((real3)(surface[0], surface[1], surface[2]), sample.wi);
      sample.emitter = (int)surface[4];
    }
  }
  return sample;
}

// Light that one sampled point of an emitter sends over the surface towards the viewer, one of `count` of them, weighted
// against one direction of the surface. u: how, which light, where.
static real3 direct_light(const Scene *s, const Surface *at, Frame frame, real3 wo, real p, real count,
                          real3 u) {
  const real3 none = (real3)(R(0));
  const real3 start = at->position + at->face * OFFSET;
  LightSample light;
  if (u.x < s->sky_share) {
    light = sample_through_panes(s, start, u.x / s->sky_share, u.y);
  } else {
    u.x = (u.x - s->sky_share) / (R(1) - s->sky_share);
    light = sample_area(s, start, u);
  }
  if (!(light.distance > R(2) * OFFSET) || !(light.cosine > R(0))) return none;
  const real3 wi = to_local(frame, light.wi);
  if (!(wi.z > R(0))) return none;
  const real density = light_pdf(s, light.emitter, light.distance * light.distance, light.cosine, light.wi);
  const real other = sampler_pdf(SAMPLER_VNDF_CAPS, wo, wi, alpha_of(at->material.roughness), p);
  const real3 f = brdf_times_cosine(at->material, wo, wi) * emitted(s, light.emitter, light.wi) / (count * density + other);
  if (!(f.x + f.y + f.z > R(0))) return none;
  return is_blocked(&s->bvh, start, light.wi, R(0), light.distance * (R(1) - OFFSET)) ? none : f;
}

static inline real3 held_to(real3 l, real most) {
  const real largest = fmax(l.x, fmax(l.y, l.z));
  return largest > most ? l * (most / largest) : l;
}

// One path: radiance that arrives at o along -d, given what the ray hits first and the surface there.
static real3 path_radiance(const Scene *s, Hit hit, const Surface *begin, real3 o, real3 d, Key key,
                           const PathOptions *options) {
  real3 radiance = (real3)(R(0)), throughput = (real3)(R(1));
  real density = R(0);        // of the direction that led here
  int count = options->light_samples;  // at the vertex before
  for (int vertex = 0; hit.triangle >= 0; ++vertex) {
    const Surface at = vertex == 0 ? *begin : surface_at(s, hit, o, d, R(0));
    if (at.emitter >= 0 && (vertex > 0 || options->with_emission)) {
      real weight = R(1);
      if (vertex > 0) {
        const real other = light_pdf(s, at.emitter, hit.t * hit.t, -dot3(at.face, d), d);
        weight = density / (density + (real)count * other);
      }
      const real3 l = throughput * emitted(s, at.emitter, d) * weight;
      radiance += vertex > 1 ? held_to(l, options->most_indirect) : l;
    }
    if (vertex == options->max_depth) break;
    const Frame frame = frame_of(at.normal);
    const real3 wo = to_local(frame, -d);
    if (!(wo.z > R(0))) break;  // a smooth normal that faces away
    const real p = specular_probability(at.material, wo);
    const real alpha = alpha_of(at.material.roughness);

    // What is seen directly gets all light samples; light that comes by way of other surfaces one.
    count = s->light_count == 0 ? 0 : vertex == 0 ? options->light_samples : min(options->light_samples, 1);
    for (int i = 0; i < count; ++i) {
      const real4 u = random4(key.seed, key.pixel, key.sample, BLOCKS * vertex + 1 + i);
      const real3 l = throughput * direct_light(s, &at, frame, wo, p, (real)count, u.xyz);
      radiance += vertex > 0 ? held_to(l, options->most_indirect) : l;
    }

    const real4 v = random4(key.seed, key.pixel, key.sample, BLOCKS * vertex);
    const real3 wi = sample_direction(SAMPLER_VNDF_CAPS, wo, alpha, p, v.xyz);
    throughput *= sample_weight(SAMPLER_VNDF_CAPS, at.material, wo, wi, p);
    const real most = fmax(throughput.x, fmax(throughput.y, throughput.z));
    if (!(most > R(0))) break;
    if (vertex >= 2) {
      const real survival = fmin(most, SURVIVAL_MOST);
      if (v.w >= survival) break;
      throughput /= survival;
    }
    density = sampler_pdf(SAMPLER_VNDF_CAPS, wo, wi, alpha, p);
    o = at.position + at.face * OFFSET;
    d = to_world(frame, wi);
    hit = nearest_hit(&s->bvh, o, d, R(0), FAR);
  }
  return radiance;
}

static inline real not_negative(real x) {
  return x < R(0) ? R(0) : x;  // a NaN stays one
}

// Samples first .. first + count - 1 of a ray. out, 8 numbers: of r, g, b the sums, then the sums of squared differences
// from the mean of those that are kept; samples dropped as not finite, and the first of these (-1). Sums are compensated
// (Kahan 1965), for a probe may have a hundred thousand samples. Squares are of differences from the first sample kept,
// or a lamp without noise would show some.
static void trace_samples(const Scene *s, real3 o, real3 d, real t_min, uint seed, uint pixel, int first, int count,
                          const PathOptions *options, global real *out) {
  const Hit hit = nearest_hit(&s->bvh, o, d, t_min, FAR);
  Surface begin;  // every sample scatters there
  if (hit.triangle >= 0) begin = surface_at(s, hit, o, d, options->spread);
  const real3 none = (real3)(R(0));
  real3 sum = none, lost = none, origin = none, apart = none, squares = none;
  int dropped = 0, first_dropped = -1;
  for (int i = 0; i < count; ++i) {
    Key key;
    key.seed = seed, key.pixel = pixel, key.sample = (uint)(first + i);
    const real3 l = path_radiance(s, hit, &begin, o, d, key, options);
    if (isfinite(l.x + l.y + l.z)) {
      if (dropped == i) origin = l;
      const real3 more = l - lost, larger = sum + more, off = l - origin;
      lost = (larger - sum) - more, sum = larger;
      apart += off, squares += off * off;
    } else {
      if (dropped == 0) first_dropped = first + i;
      ++dropped;
    }
  }
  const real3 spread = squares - apart * (apart / fmax((real)(count - dropped), R(1)));
  out[0] = sum.x, out[1] = sum.y, out[2] = sum.z;
  out[3] = not_negative(spread.x), out[4] = not_negative(spread.y), out[5] = not_negative(spread.z);
  out[6] = (real)dropped, out[7] = (real)first_dropped;
}

// A pose: 12 numbers, the upper rows of a row-major matrix to world space.
static inline real3 pose_direction(global const real *p, real3 v) {
  return (real3)(p[0] * v.x + p[1] * v.y + p[2] * v.z, p[4] * v.x + p[5] * v.y + p[6] * v.z,
                 p[8] * v.x + p[9] * v.y + p[10] * v.z);
}
static inline real3 pose_point(global const real *p, real3 v) {
  return pose_direction(p, v) + (real3)(p[3], p[7], p[11]);
}
static inline real3 pose_inverse_direction(global const real *p, real3 v) {
  return (real3)(p[0] * v.x + p[4] * v.y + p[8] * v.z, p[1] * v.x + p[5] * v.y + p[9] * v.z,
                 p[2] * v.x + p[6] * v.y + p[10] * v.z);
}

// Width of a pixel one metre along its ray (z = -1), metres: the root of its solid angle, 1 / (fx fy |ray|^3).
static inline real pixel_spread(Camera c, real3 ray) {
  const real r2 = dot3(ray, ray);
  return rsqrt(c.fx * c.fy * r2 * sqrt(r2));
}

// view: fx, fy, cx, cy, then a pose. out: {height, width, 8} as trace_samples writes it.
kernel void trace_view(SCENE_ARGUMENTS, global const real *view, const int width, const int height, const uint seed,
                       const int first, const int count, const int light_samples, const int max_depth,
                       const float most_indirect, global real *out) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1);
  if (x >= width || y >= height) return;
  SCENE_OF_ARGUMENTS(scene)
  const real3 o = pose_point(view + 4, (real3)(R(0)));
  const real3 ray = pixel_ray(camera_at(view), x, y);
  const real3 d = unit3(pose_direction(view + 4, ray));
  const int pixel = y * width + x;
  const PathOptions options = {1, light_samples, max_depth, pixel_spread(camera_at(view), ray), most_indirect};
  trace_samples(&scene, o, d, R(0), seed, (uint)pixel, first, count, &options, out + pixel * 8);
}

// points, directions: planar {3, stride}, read from `at` on, of any length; mapped to the world by `pose`.
// out: {count_rays, 8}. The ray's number keys its random numbers.
kernel void trace_rays(SCENE_ARGUMENTS, global const real *points, global const real *directions, const int at,
                       const int stride, const int rays, global const real *pose, const uint seed, const int first,
                       const int count, const int with_emission, const int light_samples, const int max_depth,
                       const float most_indirect, const float spread, global real *out) {
  const int i = (int)get_global_id(0);
  if (i >= rays) return;
  SCENE_OF_ARGUMENTS(scene)
  const int k = at + i;
  const real3 o = pose_point(pose, (real3)(points[k], points[stride + k], points[2 * stride + k]));
  // Zero, or what is not a number, stays no direction: such a ray meets nothing.
  const real3 v = pose_direction(pose, (real3)(directions[k], directions[stride + k], directions[2 * stride + k]));
  const real3 d = v / sqrt(dot3(v, v));
  const PathOptions options = {with_emission, light_samples, max_depth, spread, most_indirect};
  trace_samples(&scene, o, d, OFFSET, seed, (uint)k, first, count, &options, out + i * 8);
}

// What rays hit: t (distance; 0 where nothing is), u, v, triangle (-1). Planar points and directions as above.
kernel void trace_hits(SCENE_ARGUMENTS, global const real *points, global const real *directions, const int rays,
                       const float t_min, const float t_max, global real *out) {
  const int i = (int)get_global_id(0);
  if (i >= rays) return;
  SCENE_OF_ARGUMENTS(scene)
  const real3 o = (real3)(points[i], points[rays + i], points[2 * rays + i]);
  const real3 d = (real3)(directions[i], directions[rays + i], directions[2 * rays + i]);
  const Hit hit = nearest_hit(&scene.bvh, o, d, t_min, t_max);
  out[4 * i] = hit.triangle >= 0 ? hit.t : R(0), out[4 * i + 1] = hit.u, out[4 * i + 2] = hit.v;
  out[4 * i + 3] = (real)hit.triangle;
}

// Maps of the first surface under each pixel centre, planar {14, height, width}: axial depth in metres (0: nothing),
// shading normal in camera space 1-3, albedo 4-6, roughness 7, metallic 8, emitted radiance 9-11, emitter 12 (-1: none),
// triangle 13.
kernel void trace_maps(SCENE_ARGUMENTS, global const real *view, const int width, const int height, global real *out) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1);
  if (x >= width || y >= height) return;
  SCENE_OF_ARGUMENTS(scene)
  const real3 o = pose_point(view + 4, (real3)(R(0)));
  const real3 ray = pixel_ray(camera_at(view), x, y);
  const real3 d = unit3(pose_direction(view + 4, ray));
  const Hit hit = nearest_hit(&scene.bvh, o, d, R(0), FAR);
  real values[14] = {0};
  values[12] = values[13] = R(-1);
  if (hit.triangle >= 0) {
    const Surface at = surface_at(&scene, hit, o, d, pixel_spread(camera_at(view), ray));
    const real3 n = pose_inverse_direction(view + 4, at.normal);
    values[0] = hit.t / sqrt(dot3(ray, ray));  // ray.z = -1
    values[1] = n.x, values[2] = n.y, values[3] = n.z;
    values[4] = at.material.albedo.x, values[5] = at.material.albedo.y, values[6] = at.material.albedo.z;
    values[7] = at.material.roughness, values[8] = at.material.metallic;
    if (at.emitter >= 0) {
      const real3 e = emitted(&scene, at.emitter, d);
      values[9] = e.x, values[10] = e.y, values[11] = e.z;
    }
    values[12] = (real)at.emitter, values[13] = (real)hit.triangle;
  }
  const int pixel = y * width + x, plane = width * height;
  for (int c = 0; c < 14; ++c) out[c * plane + pixel] = values[c];
}

// Means of what trace_rays left: samples {rays, 8}, out planar {3, stride} written from `at` on. 0 where every sample of a
// ray was dropped. Local size 64.
kernel void mean_radiance(global const real *samples, const int rays, const int count, const int at, const int stride,
                          global real *out) {
  const int i = (int)get_global_id(0);
  if (i >= rays) return;
  global const real *s = samples + i * 8;
  const real kept = (real)count - s[6];
  const real scale = kept > R(0) ? R(1) / kept : R(0);
  for (int c = 0; c < 3; ++c) out[c * stride + at + i] = s[c] * scale;
}
