// The pixel that a direction from the camera points to. direction {1, 3, pixels, samples}: camera frame, any length;
// camera {items, 4, 1, 1} of pictures of w x h; hit Int {1, 1, pixels, samples}: y * w + x of the ray's own picture, or
// -1 behind the camera and beyond the picture's borders (kernels/lib/chunk.clh).
#include "lib/camera.clh"
#include "lib/chunk.clh"

kernel void project_rays(IN(direction), IN(camera), OUT_INT(hit), CHUNK_ARGS, const int items,
                         const int w, const int h) {
  RAY_OF_WORK_ITEM
  global const real *d = AT(direction, 0) + ray;
  const real3 v = (real3)(d[0], d[RAY_PLANE], d[2 * RAY_PLANE]);
  const int n = min((first_pixel + p) / (w * h), items - 1);
  int at = -1;
  if (s < samples && v.z < R(0)) {
    const real2 q = project(camera_at(AT(camera, n)), v);
    if (q.x >= R(0) && q.x < (real)w && q.y >= R(0) && q.y < (real)h) at = (int)q.y * w + (int)q.x;
  }
  AT(hit, 0)[ray] = at;
}
