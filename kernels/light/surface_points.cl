// The points that a depth map shows, camera metres: {n, 1, h, w} -> {n, 3, h, w}; (0, 0, 0) where there is no depth.
#include "lib/camera.clh"

kernel void surface_points(IN(depth), IN(camera), OUT(points), const int w, const int h) {
  const int pixel = (int)get_global_id(0);
  const int n = (int)get_global_id(1);
  if (pixel >= w * h) return;
  const int j = pixel / w;
  const real z = AT(depth, n)[pixel];
  const real3 point = is_depth(z) ? z * pixel_ray(camera_at(AT(camera, n)), pixel - j * w, j) : (real3)(R(0));
  AT(points, n)[pixel] = point.x;
  AT(points, n)[w * h + pixel] = point.y;
  AT(points, n)[2 * w * h + pixel] = point.z;
}
