#include "host/math/envmap.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/gtc/constants.hpp>

#include "host/error.hpp"

namespace clerestory {
namespace {

std::uint64_t splitmix(std::uint64_t number) {
  std::uint64_t z = number * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

double unit(std::uint64_t bits) { return (static_cast<double>(bits & 0xffffff) + 0.5) * 0x1p-24; }

double elevation_cosine(int edge) { return std::cos(edge * glm::half_pi<double>() / envmap_elevations); }

}  // namespace

EnvmapLayout EnvmapLayout::of(int width, int height) {
  if (width < 1 || height < 1)
    throw usage_error("a view without pixels", "size", fmt::format("{}x{}", width, height), "positive sides");
  const int longer = std::max(width, height), shorter = std::min(width, height);
  const int tiles = std::max(1, static_cast<int>(std::lround(static_cast<double>(envmap_tiles) * shorter / longer)));
  return width >= height ? EnvmapLayout{width, height, envmap_tiles, tiles}
                         : EnvmapLayout{width, height, tiles, envmap_tiles};
}

int EnvmapLayout::pixel_x(int column) const { return (2 * column + 1) * width / (2 * columns); }
int EnvmapLayout::pixel_y(int row) const { return (2 * row + 1) * height / (2 * rows); }

Vec3 envmap_direction(int column, int row, int azimuth, int elevation) {
  const int texel = ((envmap_tiles * row + column) * envmap_elevations + elevation) * envmap_azimuths + azimuth;
  const std::uint64_t bits = splitmix(static_cast<std::uint64_t>(texel) + 1);
  const double first = elevation_cosine(elevation), last = elevation_cosine(elevation + 1);
  // The last row's edge is 6e-17, not 0: directions stay above the surface.
  const double z = first + (last - first) * unit(bits >> 40), across = std::sqrt((1 - z) * (1 + z));
  const double angle = ((azimuth + unit(bits >> 16)) / envmap_azimuths - 0.5) * glm::two_pi<double>();
  return {across * std::cos(angle), across * std::sin(angle), z};
}

double envmap_solid_angle(int elevation) {
  return glm::two_pi<double>() / envmap_azimuths * (elevation_cosine(elevation) - elevation_cosine(elevation + 1));
}

}  // namespace clerestory
