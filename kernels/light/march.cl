// Where a volume is looked at along rays (Zhu et al. 2022, section 4.3, as released): K points between a near distance and the exit from a
// sphere around the camera, one in each of K equal pieces, jittered within it or (JITTER not defined) in its middle.
//
// points, direction {1, 3, pixels, samples}: camera metres, any length; range {n, 3, 1, 1}: scene_scale first (metres), the
// unit of everything that follows: position {K, 3, ...}, length {K, 1, ...} from each point to the next, of the last to the
// sphere; near, radius. A ray that never meets the sphere's inside has K points at its start and no length.
#include "lib/chunk.clh"
#include "lib/frame.clh"
#include "lib/rng.clh"

#define SALT 0x6d617263u

// Distance from p along the unit vector d to where the sphere is left; 0 if it is not ahead. The root that does not
// cancel: with c = |p|^2 - r^2 the two are -b -+ sqrt(b^2 - c), and their product is c.
static inline real sphere_exit(real3 p, real3 d, real radius) {
  const real b = dot3(p, d), c = (sqrt(dot3(p, p)) - radius) * (sqrt(dot3(p, p)) + radius);
  const real inside = b * b - c;
  if (inside <= R(0) || (c >= R(0) && b >= R(0))) return R(0);
  const real root = sqrt(inside);
  return b > R(0) ? -c / (b + root) : root - b;
}

kernel void march(IN(points), IN(direction), IN(range), OUT(position), OUT(length), CHUNK_ARGS, const int items,
                  const int plane, const int segments, const real near, const real radius, const uint seed) {
  RAY_OF_WORK_ITEM
  const int n = min((first_pixel + p) / plane, items - 1);
  const real scale = AT(range, n)[0];
  global const real *from = AT(points, 0) + ray, *along = AT(direction, 0) + ray;
  const real3 origin = (real3)(from[0], from[RAY_PLANE], from[2 * RAY_PLANE]) / scale;
  const real3 d = unit3((real3)(along[0], along[RAY_PLANE], along[2 * RAY_PLANE]));
  const real far = max(sphere_exit(origin, d, radius), near), piece = (far - near) / (real)segments;
  real4 jitter = (real4)(R(0.5));
  real here = near;
  for (int k = 0; k < segments; ++k) {
#ifdef JITTER
    if ((k & 3) == 0) jitter = random4(seed ^ SALT, (uint)(first_pixel + p), (uint)(first_sample + s), (uint)(k >> 2));
    const real share = (k & 3) == 0 ? jitter.x : (k & 3) == 1 ? jitter.y : (k & 3) == 2 ? jitter.z : jitter.w;
#else
    const real share = jitter.x;
#endif
    const real t = near + ((real)k + share) * piece;
    if (k > 0) AT(length, k - 1)[ray] = t - here;
    here = t;
    const real3 at = origin + t * d;
    global real *x = AT(position, k) + ray;
    x[0] = at.x, x[RAY_PLANE] = at.y, x[2 * RAY_PLANE] = at.z;
  }
  AT(length, segments - 1)[ray] = max(far - here, R(0));
}
