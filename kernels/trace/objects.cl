// Rays against inserted objects alone: where they hit, and the surface there.
//
// Rays of a chunk (kernels/lib/chunk.clh): directions {3, pixels, samples}; origins {3, h * w} of the pixel's own point
// (per_pixel), or {3, pixels, samples}. A zero direction is no ray. Results in the rays' layout: distance in units of the
// direction's length, 0 on a miss; point 3; normal 3, unit, on the ray's side of the triangle; object, -1 on a miss.
// normals: for each triangle those of its corners, then its own. An interpolated one that looks away from the ray is of
// a side that is not seen: the triangle's own stands in for it.
#include "lib/chunk.clh"
#include "trace/bvh.clh"
#include "lib/frame.clh"

kernel void meet_objects(global const real *planes, global const int *children, global const real *corners,
                         global const int *triangles, global const real *normals, global const int *objects,
                         IN(points), IN(directions), OUT(distance), OUT(point), OUT(normal), OUT_INT(object),
                         CHUNK_ARGS, const int per_pixel, const int plane, const float t_min) {
  const int s = (int)get_global_id(0);
  const int p = (int)get_global_id(1);
  if (s >= samples || p >= pixels) return;
  Bvh bvh;
  bvh.planes = planes, bvh.children = children, bvh.corners = corners, bvh.triangles = triangles;
  GIVE_STACK(bvh)
  const ulong ray = RAY(p, s), step = RAY_PLANE;
  global const real *from = AT(points, 0);
  const ulong at = per_pixel ? (ulong)(first_pixel + p) : ray, origin_step = per_pixel ? (ulong)plane : step;
  const real3 o = (real3)(from[at], from[origin_step + at], from[2 * origin_step + at]);
  global const real *towards = AT(directions, 0) + ray;
  const real3 d = (real3)(towards[0], towards[step], towards[2 * step]);

  Hit hit;
  hit.triangle = -1;
  if (dot3(d, d) > R(0)) hit = nearest_hit(&bvh, o, d, (real)t_min, R(1e6));
  const int met = hit.triangle >= 0;
  real3 n = (real3)(R(0));
  if (met) {
    global const real *v = normals + 12 * hit.triangle;
    const real w = R(1) - hit.u - hit.v;
    real3 face = (real3)(v[9], v[10], v[11]);
    if (dot3(face, d) > R(0)) face = -face;
    n = unit3((real3)(w * v[0] + hit.u * v[3] + hit.v * v[6], w * v[1] + hit.u * v[4] + hit.v * v[7],
                      w * v[2] + hit.u * v[5] + hit.v * v[8]));
    if (dot3(n, face) < R(0)) n = -n;
    if (dot3(n, d) > R(0)) n = face;
  }
  const real3 x = met ? o + d * hit.t : o;
  AT(distance, 0)[ray] = met ? hit.t : R(0);
  AT(object, 0)[ray] = met ? objects[hit.triangle] : -1;
  global real *px = AT(point, 0) + ray, *nx = AT(normal, 0) + ray;
  px[0] = x.x, px[step] = x.y, px[2 * step] = x.z;
  nx[0] = n.x, nx[step] = n.y, nx[2 * step] = n.z;
}
