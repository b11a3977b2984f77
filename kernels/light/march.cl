// Where a volume is looked at along rays (Zhu et al. 2022, section 4.3, as released): K points between a near distance
// and the exit from a sphere around the camera, one in each of K equal pieces, jittered within it or (JITTER not
// defined) in its middle.
//
// points, direction {1, 3, pixels, samples}: camera metres, any length; range {n, 3, 1, 1}: scene_scale first (metres),
// the unit of everything that follows: position {K, 3, ...}, length {K, 1, ...} from each point to the next, of the
// last to the sphere; near, radius. A ray that never meets the sphere's inside has K points at its start and no length.
#include "lib/chunk.clh"
#include "light/march.clh"

kernel void march(IN(points), IN(direction), IN(range), OUT(position), OUT(length), CHUNK_ARGS, const int items,
                  const int plane, const int segments, const real near, const real radius, const uint seed) {
  RAY_OF_WORK_ITEM
  const int n = min((first_pixel + p) / plane, items - 1);
  global const real *from = AT(points, 0) + ray, *along = AT(direction, 0) + ray;
  const MarchRay r = march_ray((real3)(from[0], from[RAY_PLANE], from[2 * RAY_PLANE]),
                               (real3)(along[0], along[RAY_PLANE], along[2 * RAY_PLANE]), AT(range, n)[0], near, radius,
                               segments);
  real4 jitter = (real4)(R(0.5));
  real here = near;
  for (int k = 0; k < segments; ++k) {
#ifdef JITTER
    if ((k & 3) == 0) jitter = march_jitter(seed, first_pixel + p, first_sample + s, k);
    const real share = (k & 3) == 0 ? jitter.x : (k & 3) == 1 ? jitter.y : (k & 3) == 2 ? jitter.z : jitter.w;
#else
    const real share = jitter.x;
#endif
    const real t = near + ((real)k + share) * r.piece;
    if (k > 0) AT(length, k - 1)[ray] = t - here;
    here = t;
    const real3 at = r.origin + t * r.d;
    global real *x = AT(position, k) + ray;
    x[0] = at.x, x[RAY_PLANE] = at.y, x[2 * RAY_PLANE] = at.z;
  }
  AT(length, segments - 1)[ray] = max(r.far - here, R(0));
}
