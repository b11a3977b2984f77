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

// x mirrored at both ends of [low, high] until it lies between them.
static inline real folded(real x, real low, real high) {
  const real t = (x - low) / (high - low);
  return low + fabs(t - R(2) * floor(R(0.5) * t + R(0.5))) * (high - low);
}

// The same where the picture goes on mirrored at its borders, all around (after Khan et al. 2006, Image-Based Material
// Editing): azimuth, then the angle above the horizon in the column's plane, are folded into those that the picture
// spans. Every direction points to a pixel; (0, 0, 0) to none.
kernel void mirrored_rays(IN(direction), IN(camera), OUT_INT(hit), CHUNK_ARGS, const int items, const int w,
                          const int h) {
  RAY_OF_WORK_ITEM
  global const real *d = AT(direction, 0) + ray;
  const real3 v = (real3)(d[0], d[RAY_PLANE], d[2 * RAY_PLANE]);
  const int n = min((first_pixel + p) / (w * h), items - 1);
  const real level = sqrt(v.x * v.x + v.z * v.z);
  int at = -1;
  if (s < samples && (level > R(0) || v.y != R(0))) {
    const Camera c = camera_at(AT(camera, n));
    const real turn = level > R(0) ? atan2(v.x, -v.z) : R(0);
    const real column = folded(turn, atan(-c.cx / c.fx), atan(((real)w - c.cx) / c.fx));
    const real rise = atan2(v.y, level * cos(column));
    const real row = folded(rise, atan((c.cy - (real)h) / c.fy), atan(c.cy / c.fy));
    const int x = clamp((int)(c.cx + c.fx * tan(column)), 0, w - 1), y = clamp((int)(c.cy - c.fy * tan(row)), 0, h - 1);
    at = y * w + x;
  }
  AT(hit, 0)[ray] = at;
}
