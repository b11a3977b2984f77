#include "experiments/truth/host_rays.hpp"

#include "tracer/trace_scene.hpp"

namespace clerestory {
namespace {

std::vector<float> values_of(Device& device, const TensorView& view) {
  std::vector<float> values(static_cast<std::size_t>(view.shape.count()));
  device.read(view.buffer, values.data(), values.size() * sizeof(float), view.offset * sizeof(float));
  return values;
}

}  // namespace

DenseRays dense_rays(Device& device, const HostRays& rays) {
  const std::vector<float> points = values_of(device, rays.points), directions = values_of(device, rays.direction);
  const auto pixels = static_cast<std::size_t>(rays.points.shape.plane());
  const auto plane = static_cast<std::size_t>(rays.direction.shape.plane());
  DenseRays dense;
  for (int p = 0; p < rays.chunk.pixels; ++p)
    for (int s = 0; s < rays.chunk.samples; ++s) {
      const std::size_t i = static_cast<std::size_t>(p) * rays.sample_capacity + s;
      if (directions[i] == 0 && directions[plane + i] == 0 && directions[2 * plane + i] == 0) continue;
      dense.at.push_back(i), dense.pixel.push_back(rays.chunk.first_pixel + p);
    }
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < dense.count(); ++i) {
      dense.points.push_back(points[c * pixels + static_cast<std::size_t>(dense.pixel[i])]);
      dense.directions.push_back(directions[c * plane + dense.at[i]]);
    }
  if (!rays.lobe.buffer) return dense;
  const std::vector<float> specular = values_of(device, rays.specular), density = values_of(device, rays.lobe);
  for (const std::size_t i : dense.at) dense.lobes.density.push_back(density[i]);
  for (std::size_t c = 0; c < 3; ++c)
    for (const std::size_t i : dense.at) dense.lobes.specular.push_back(specular[c * plane + i]);
  return dense;
}

void leave_surface(DenseRays& rays, const Image& normal) {
  const std::size_t count = rays.count();
  for (int c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t at = static_cast<std::size_t>(c) * count + i;
      rays.points[at] += kRayOffset * (normal.plane(c)[rays.pixel[i]] - rays.directions[at]);
    }
}

void place_radiance(Device& device, const HostRays& rays, const DenseRays& dense, const std::vector<float>& radiance) {
  const TensorView& to = rays.radiance;
  std::vector<float> values(static_cast<std::size_t>(to.shape.count()), 0);
  const auto plane = static_cast<std::size_t>(to.shape.plane());
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < dense.count(); ++i) values[c * plane + dense.at[i]] = radiance[c * dense.count() + i];
  device.write(to.buffer, values.data(), values.size() * sizeof(float), to.offset * sizeof(float));
}

}  // namespace clerestory
