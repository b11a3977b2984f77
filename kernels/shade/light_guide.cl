// Where each pixel looks for light: lamps that are known of become lobes of directions (lib/guide.clh).
//
// lamps {n, 5, 1, K}: middle (camera metres), size (metres), radiance over that of the rest of the light; 0: none. From a
// point at distance r a lamp is taken to be radiance exp(-s (1 - cos theta)), s = (r / size)^2, which is what soft lamps
// are (light/soft_lamps.cl), and is drawn as that. Lobes have probabilities as the irradiance that their lamps would
// bring,  e = radiance 2 (1 - exp(-2 s)) / s (n.d + 1 / sqrt(s))  over that of the rest, pi: half of a lamp below the
// horizon counts. Of all samples the share E / (1 + E), E the sum of e, is drawn by lobes, but for MOST; of a lobe of the
// surface that is narrow, which meets the lamps that it shows by itself, less. A lobe of less than LEAST of E is left
// out. Nothing has to be right here but sums: any mixture is unbiased.
//
// Maps of the pixels: depth {n, 1, h, w}, camera {n, 4, 1, 1}, normal and albedo {n, 3}, material {n, 2 or more}.
// guide {P, 2 + 6 K, 1, 1}: the rows of a chunk's pixels.
#include "lib/camera.clh"
#include "lib/guide.clh"
#include "lib/surface.clh"

#define MOST R(0.6)
#define LEAST R(0.01)
// Bounds of sharpness: of a lamp all around, and of one of a fiftieth of its distance, which is about what depth tells of
// its direction.
#define LEAST_SHARPNESS R(0.01)
#define MOST_SHARPNESS R(2500)

typedef struct {
  real3 axis;
  real sharpness, light;
} SeenLamp;

static inline SeenLamp seen_lamp(global const real *lamps, const int count, const int k, const real3 point,
                                 const real3 normal) {
  const real3 to = (real3)(lamps[k], lamps[count + k], lamps[2 * count + k]) - point;
  const real size = lamps[3 * count + k];
  SeenLamp lamp;
  lamp.axis = unit3(to);
  lamp.sharpness = clamp(dot3(to, to) / (size * size), LEAST_SHARPNESS, MOST_SHARPNESS);
  const real facing = fmax(dot3(normal, lamp.axis) + rsqrt(lamp.sharpness), R(0));
  lamp.light = lamps[4 * count + k] * facing * (R(2) * lobe_on_sphere(lamp.sharpness) / lamp.sharpness);
  return lamp;
}

// The share of a surface's reflection that is broad: a narrow lobe's own directions are better than the lamps'.
static inline real broad_share(const Material m, const real3 wo) {
  return R(1) - specular_probability(m, wo) * (R(1) - fmin(alpha_of(m.roughness), R(1)));
}

kernel void light_guide(IN(depth), IN(camera), IN(normal), IN(albedo), IN(material), IN(lamps), OUT(guide),
                        const int first_pixel, const int pixels, const int w, const int h, const int items,
                        const int count) {
  const int p = (int)get_global_id(0);
  if (p >= pixels) return;
  const int plane = w * h, n = (first_pixel + p) / plane, pixel = first_pixel + p - n * plane;
  const real z = AT(depth, n)[pixel];
  const real3 ray = pixel_ray(camera_at(AT(camera, n)), pixel % w, pixel / w);
  const real3 mapped = rgb_at(AT(normal, n), plane, pixel), towards = unit3(mapped / unit_near(mapped));
  const Material m = material_at(AT(albedo, n), AT(material, n), plane, pixel);
  global const real *known = AT(lamps, min(n, items - 1));
  global real *row = AT(guide, p);

  real all = R(0);
  for (int k = 0; k < count; ++k) all += seen_lamp(known, count, k, z * ray, towards).light;
  real kept = R(0);
  for (int k = 0; k < count; ++k) {
    const real light = seen_lamp(known, count, k, z * ray, towards).light;
    kept += light > LEAST * all ? light : R(0);
  }
  const real3 wo = (real3)(R(0), R(0), dot3(towards, -unit3(ray)));  // only its cosine is read
  const real chance = MOST * broad_share(m, wo) * (all / (R(1) + all));
  const int aims = z > R(0) && kept > R(0) && chance > R(0) && isfinite(kept);

  int lobes = 0;
  real sum = R(0);
  for (int k = 0; k < count; ++k) {
    const SeenLamp lamp = seen_lamp(known, count, k, z * ray, towards);
    if (!aims || !(lamp.light > LEAST * all)) continue;
    global real *lobe = row + GUIDE_HEAD + lobes * GUIDE_LOBE;
    const real share = chance * (lamp.light / kept);
    sum += share;
    lobe[0] = lamp.axis.x, lobe[1] = lamp.axis.y, lobe[2] = lamp.axis.z;
    lobe[3] = lamp.sharpness;
    lobe[4] = sum;
    lobe[5] = share * lamp.sharpness * (R(0.5) * INV_PI / lobe_on_sphere(lamp.sharpness));
    ++lobes;
  }
  row[0] = aims ? chance : R(0), row[1] = (real)lobes;
  for (int i = GUIDE_HEAD + lobes * GUIDE_LOBE; i < GUIDE_HEAD + count * GUIDE_LOBE; ++i) row[i] = R(0);
}
