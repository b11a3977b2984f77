// Radiance along rays that may meet an inserted object before they meet the scene.
//
// Rays {1, C, pixels, samples} (kernels/lib/chunk.clh): direction 3; hit: pixel y * w + x of the scene that the ray meets,
// or -1; object, -1: none; distance to it, in units of the direction's length; scene 3: radiance of the scene along the
// ray; weight 3 and beyond 3: what the object reflects is weight * beyond. depth {1, 1, h, w} of the scene, camera
// {1, 4, 1, 1}; points: where rays start, {1, 3, h, w} of the ray's pixel (per_pixel) or {1, 3, pixels, samples}.
// The scene's own distance is that of the point at the middle of the hit cell, projected on the ray.
// With `difference`, shows {1, 1, h, w}: where it is 0 (the pixel shows the scene) the scene's radiance is taken away, so
// that sums give what the objects change.
#include "lib/camera.clh"
#include "lib/chunk.clh"
#include "lib/frame.clh"

kernel void nearer(IN(points), IN(direction), IN_INT(hit), IN_INT(object), IN(distance), IN(scene), IN(weight),
                   IN(beyond), IN(depth), IN(camera), IN(shows), OUT(radiance), CHUNK_ARGS, const int per_pixel,
                   const int difference, const int w, const int h) {
  const int s = (int)get_global_id(0);
  const int p = (int)get_global_id(1);
  if (s >= samples || p >= pixels) return;
  const ulong ray = RAY(p, s), step = RAY_PLANE;
  const ulong at = per_pixel ? (ulong)(first_pixel + p) : ray, origin_step = per_pixel ? (ulong)(w * h) : step;
  global const real *from = AT(points, 0) + at, *d = AT(direction, 0) + ray;
  const real3 o = (real3)(from[0], from[origin_step], from[2 * origin_step]);
  const real3 v = (real3)(d[0], d[step], d[2 * step]);

  const int pixel = AT(hit, 0)[ray];
  const int cell = max(pixel, 0), j = cell / w;
  const real3 seen = AT(depth, 0)[cell] * pixel_ray(camera_at(AT(camera, 0)), cell - j * w, j);
  const int before = AT(object, 0)[ray] >= 0 && (pixel < 0 || AT(distance, 0)[ray] * dot3(v, v) < dot3(seen - o, v));
  const int take_away = difference && AT(shows, 0)[first_pixel + p] == R(0);
  for (int c = 0; c < 3; ++c) {
    const real of_scene = AT(scene, 0)[c * step + ray];
    const real of_object = AT(weight, 0)[c * step + ray] * AT(beyond, 0)[c * step + ray];
    AT(radiance, 0)[c * step + ray] = (before ? of_object : of_scene) - (take_away ? of_scene : R(0));
  }
}

// Of the rays of pixels that show the scene only those that meet an object change anything: direction where the ray is
// one of these or its pixel shows an object, (0, 0, 0) elsewhere, so that no light is asked for it.
kernel void needed_rays(IN(direction), IN_INT(object), IN(shows), OUT(needed), CHUNK_ARGS) {
  RAY_OF_WORK_ITEM
  const int need = AT(object, 0)[ray] >= 0 || AT(shows, 0)[first_pixel + p] != R(0);
  for (int c = 0; c < 3; ++c) {
    const ulong at = c * RAY_PLANE + ray;
    AT(needed, 0)[at] = need ? AT(direction, 0)[at] : R(0);
  }
}
