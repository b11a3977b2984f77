#include "tracer/envmaps.hpp"

#include <cmath>

namespace clerestory {
namespace {

/// What a pixel shows, in camera space: the point, the normal that shading uses, and that of the triangle, towards the
/// camera.
struct SurfacePoint {
  Vec3 position, normal, face;
};

SurfacePoint surface_at(const World& world, const Camera& camera, const TraceMaps& maps, int x, int y) {
  const std::size_t pixel = static_cast<std::size_t>(y) * camera.width + x;
  SurfacePoint p;
  p.position = camera.unproject(x + 0.5, y + 0.5, static_cast<double>(maps.depth.data[pixel]));
  p.normal =
      glm::normalize(Vec3(maps.normal.plane(0)[pixel], maps.normal.plane(1)[pixel], maps.normal.plane(2)[pixel]));
  const Triangle& t = world.triangles[static_cast<std::size_t>(maps.triangle[pixel])];
  const Vec3 first(t.v[1].position - t.v[0].position), second(t.v[2].position - t.v[0].position);
  p.face = camera.direction_to_camera(glm::normalize(glm::cross(first, second)));
  if (glm::dot(p.face, p.position) > 0) p.face = -p.face;
  return p;
}

}  // namespace

Envmaps trace_envmaps(TraceScene& scene, const World& world, const Camera& camera, const TraceMaps& maps,
                      const RadianceQuery& query, DroppedSamples* dropped) {
  Envmaps out;
  out.layout = EnvmapLayout::of(camera.width, camera.height);
  out.radiance = Image(out.layout.file_width(), out.layout.file_height(), 3);
  const std::size_t texels = out.radiance.pixels();
  std::vector<Vec3> points(texels, Vec3(0)), directions(texels, Vec3(0));  // rays without a direction meet nothing
  for (int row = 0; row < out.layout.rows; ++row) {
    for (int column = 0; column < out.layout.columns; ++column) {
      const int x = out.layout.pixel_x(column), y = out.layout.pixel_y(row);
      if (maps.depth.at(0, y, x) <= 0) continue;
      const SurfacePoint surface = surface_at(world, camera, maps, x, y);
      const Frame frame = hemisphere_frame(surface.normal);
      for (int elevation = 0; elevation < envmap_elevations; ++elevation) {
        for (int azimuth = 0; azimuth < envmap_azimuths; ++azimuth) {
          const Vec3 d = envmap_direction(frame, column, row, azimuth, elevation);
          const std::size_t i = static_cast<std::size_t>(row * envmap_elevations + elevation) * out.radiance.width +
                                static_cast<std::size_t>(column * envmap_azimuths + azimuth);
          // A query ignores what is nearer than the offset; the tracer's paths start that far off the surface and
          // ignore nothing. Both begin at one place when the ray is drawn back by as much.
          points[i] = surface.position + static_cast<double>(kRayOffset) * (surface.face - d);
          directions[i] = d;
        }
      }
    }
  }
  RadianceQuery from_camera = query;
  from_camera.to_world = camera.camera_to_world;
  from_camera.spread = static_cast<float>(1 / std::sqrt(camera.fx * camera.fy));
  out.radiance.data = scene.radiance(planar(points), planar(directions), from_camera, dropped);
  return out;
}

}  // namespace clerestory
