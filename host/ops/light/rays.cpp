#include "host/ops/light/rays.hpp"

#include <algorithm>

namespace clerestory {

RayTile ray_tile(const Launch& launch, const Shape& rays, long pixels) {
  if (launch.chunk.pixels == 0) return {0, static_cast<int>(std::min<long>(rays.h, pixels)), 0, rays.w, rays.h, rays.w};
  return {
      launch.chunk.first_pixel, launch.chunk.pixels, launch.chunk.first_sample, launch.chunk.samples, rays.h, rays.w};
}

void check_rays(const Value& rays, int channels, const char* op) {
  const Shape& s = rays.shape();
  if (s.n != 1 || s.c != channels || s.w % 16 != 0)
    throw Error(ErrorKind::Failed, "not a tensor of rays", op, s.text(), fmt::format("1x{}xPIXELSx(16 k)", channels));
}

void check_points(const Value& points, const Value& directions, const char* op) {
  const Shape &p = points.shape(), &rays = directions.shape();
  if (p.n != 1 || p.c != 3 || p.h != rays.h || (p.w != rays.w && p.w != 1))
    throw Error(ErrorKind::Failed, "points and directions are of different rays", op, p.text(),
                fmt::format("{}, or one sample of it", rays.text()));
}

void check_lobes(const Lobes& lobes, const Value& directions, const char* op) {
  if (!lobes) return;
  const Shape& rays = directions.shape();
  if (!(lobes.specular.shape() == rays) || !(lobes.density.shape() == Shape{1, 1, rays.h, rays.w}))
    throw Error(ErrorKind::Failed, "directions and lobes are of different rays", op, lobes.specular.shape().text(),
                rays.text());
}

Range ray_range(const RayTile& tile) {
  const std::size_t samples = static_cast<std::size_t>(tile.sample_capacity);
  return Range::of2(samples, static_cast<std::size_t>(tile.pixels), samples % 64 == 0 ? 64 : 16);
}

}  // namespace clerestory
