#include "experiments/training/light_batches.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "experiments/training/keyed.hpp"
#include "host/error.hpp"
#include "host/math/panorama.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/ssrt.hpp"

namespace clerestory {
namespace {

enum Purpose : std::uint64_t { ray_draw = 11, flip_draw, exposure_draw, clip_draw, grid_x_draw, grid_y_draw };

/// One view's share of a batch, mirrored if so drawn.
struct Prepared {
  Image image, albedo, normal, depth, material, emission;
  Camera camera;
  LightRays rays;
};

void mirror(Prepared& p) {
  for (Image* map : {&p.image, &p.albedo, &p.depth, &p.material, &p.emission}) *map = mirrored(*map);
  p.normal = mirrored_normals(p.normal);
  p.camera.cx = p.camera.width - p.camera.cx;
  for (Vec3& point : p.rays.points) point.x = -point.x;
  for (Vec3& d : p.rays.directions) d.x = -d.x;
  const int w = p.image.width;
  for (int& pixel : p.rays.skip)
    if (pixel >= 0) pixel = pixel / w * w + (w - 1 - pixel % w);
}

Prepared prepared(const LightView& view, const LightTrainingOptions& o, const LightSampling& sampling,
                  std::uint64_t key) {
  Prepared p{view.image,    view.albedo,   view.normal, view.depth,
             view.material, view.emission, view.camera, draw_rays(view, o.rows, o.samples, sampling.probe_rows, key)};
  const double target =
      sampling.exposure_low + (sampling.exposure_high - sampling.exposure_low) * keyed_uniform(key, 0, exposure_draw);
  const float gain = static_cast<float>(target / 0.9);
  for (float& v : p.image.data) v *= gain;
  for (auto& rgb : p.rays.light)
    for (float& v : rgb) v *= gain;
  if (sampling.ldr) {
    for (float& v : p.image.data) v = std::clamp(v, 0.f, 1.f);
    for (auto& rgb : p.rays.light)
      for (float& v : rgb) v = std::clamp(v, 0.f, 1.f);
  }
  if (sampling.flip && keyed_uniform(key, 0, flip_draw) < 0.5) mirror(p);
  return p;
}

/// Appends a picture to a batch of them.
void append(LightBatch& batch, const std::string& name, const Image& image) {
  Tensor& t = batch.feeds[name];
  t.shape = {t.shape.n + (t.real.empty() ? 0 : 1), image.channels, image.height, image.width};
  t.real.insert(t.real.end(), image.data.begin(), image.data.end());
}

void append(LightBatch& batch, const std::string& name, const Tensor& one) {
  Tensor& t = batch.feeds[name];
  const int n = t.real.empty() ? 0 : t.shape.n;
  t.shape = one.shape, t.shape.n = n + 1;
  t.real.insert(t.real.end(), one.real.begin(), one.real.end());
}

void put_rays(LightBatch& batch, const LightRays& rays, int samples, const std::string& at) {
  for (auto& [name, tensor] : ray_tensors(rays, samples)) batch.feeds[name + at] = std::move(tensor);
  const int rows = static_cast<int>(rays.light.size()) / samples;
  Tensor light(Shape{1, 3, rows, samples});
  for (std::size_t i = 0; i < rays.light.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) light.real[c * rays.light.size() + i] = rays.light[i][c];
  batch.feeds["light" + at] = std::move(light), batch.feeds["known" + at] = Tensor({1, 1, rows, samples}, 1);
}

/// The coarse grid of pixels that are rendered again.
void put_shading(LightBatch& batch, const Prepared& p, const LightTrainingOptions& o, std::uint64_t key,
                 const std::string& at) {
  const int stride = shade_stride(o, p.image.width, p.image.height);
  if (stride == 0)
    throw usage_error("the grid that is rendered again does not divide the view", "light.shade_width",
                      fmt::format("{}x{}", o.shade_width, o.shade_height),
                      fmt::format("one step along both sides of {}x{}", p.image.width, p.image.height));
  const int x0 = std::min(static_cast<int>(stride * keyed_uniform(key, 0, grid_x_draw)), stride - 1);
  const int y0 = std::min(static_cast<int>(stride * keyed_uniform(key, 0, grid_y_draw)), stride - 1);
  const auto coarse = [&](const Image& map) { return every_nth(map, stride, x0, y0); };
  const Image depth = coarse(p.depth), emission = coarse(p.emission);
  Image mask(depth.width, depth.height, 1);
  for (std::size_t i = 0; i < mask.data.size(); ++i)
    mask.data[i] = depth.data[i] > 0 && emission.data[i] == 0 ? 1.f : 0.f;
  append(batch, "shade_image", coarse(p.image)), append(batch, "shade_albedo", coarse(p.albedo));
  append(batch, "shade_normal", coarse(p.normal)), append(batch, "shade_material", coarse(p.material));
  append(batch, "shade_depth", depth), append(batch, "shade_mask", mask);
  const Camera camera = every_nth(p.camera, stride, x0, y0);
  append(batch, "shade_camera", camera_tensor(std::span(&camera, 1)));
  std::vector<int> skip;
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x)
      skip.insert(skip.end(), static_cast<std::size_t>(o.shade_samples),
                  (stride * y + y0) * p.image.width + stride * x + x0);
  batch.feeds["shade_skip" + at] = Tensor::of_int({1, 1, depth.height * depth.width, o.shade_samples}, std::move(skip));
}

}  // namespace

LightRays draw_rays(const LightView& view, int rows, int samples, double probe_rows, std::uint64_t key) {
  constexpr int texels = envmap_azimuths * envmap_elevations;
  if (samples > texels)
    throw usage_error("more directions than a tile has", "light.samples", std::to_string(samples),
                      std::to_string(texels));
  const EnvmapLayout& layout = view.envmaps.layout;
  std::vector<int> tiles;
  for (int tile = 0; tile < layout.tiles(); ++tile)
    if (const int y = layout.pixel_y(tile / layout.columns), x = layout.pixel_x(tile % layout.columns);
        view.true_depth.at(0, y, x) > 0 && view.depth.at(0, y, x) > 0)
      tiles.push_back(tile);
  KeyedDraws draws(key, ray_draw);
  LightRays rays;
  const auto add = [&](const Vec3& point, const Vec3& direction, const std::array<float, 3>& light, int skip) {
    rays.points.push_back(point), rays.directions.push_back(direction);
    rays.light.push_back(light), rays.skip.push_back(skip);
  };
  int from_probes = view.probes.empty() ? 0 : static_cast<int>(std::lround(rows * probe_rows));
  if (tiles.empty() && !view.probes.empty()) from_probes = rows;
  for (int row = 0; row < rows; ++row) {
    if (row < from_probes) {
      const Probe& probe = view.probes[static_cast<std::size_t>(draws.below(static_cast<int>(view.probes.size())))];
      for (int s = 0; s < samples; ++s) {
        const int x = draws.below(probe_width);
        const int y = std::min(static_cast<int>(std::acos(1 - 2 * draws.unit()) / std::numbers::pi * probe_height),
                               probe_height - 1);
        const std::array<float, 3> light{probe.radiance.at(0, y, x), probe.radiance.at(1, y, x),
                                         probe.radiance.at(2, y, x)};
        add(probe.center, panorama_direction(x, y, probe_width, probe_height), light, -1);
      }
      continue;
    }
    const int tile = tiles.at(static_cast<std::size_t>(draws.below(static_cast<int>(tiles.size()))));
    const int column = tile % layout.columns, r = tile / layout.columns;
    const int x = layout.pixel_x(column), y = layout.pixel_y(r);
    const Image& n = view.true_normal;
    const Vec3 normal{n.at(0, y, x), n.at(1, y, x), n.at(2, y, x)};
    const Frame frame = hemisphere_frame(normal);
    const Vec3 point = view.camera.unproject(x + 0.5, y + 0.5, view.depth.at(0, y, x));
    std::array<int, texels> order;
    for (int k = 0; k < texels; ++k) order[static_cast<std::size_t>(k)] = k;
    for (int s = 0; s < samples; ++s) {
      std::swap(order[static_cast<std::size_t>(s)], order[static_cast<std::size_t>(s + draws.below(texels - s))]);
      const int texel = order[static_cast<std::size_t>(s)];
      const int azimuth = texel % envmap_azimuths, elevation = texel / envmap_azimuths;
      add(point, envmap_direction(frame, column, r, azimuth, elevation), view.envmaps.at(column, r, azimuth, elevation),
          y * view.depth.width + x);
    }
  }
  return rays;
}

std::map<std::string, Tensor> ray_tensors(const LightRays& rays, int samples) {
  const std::size_t count = rays.skip.size();
  const int rows = static_cast<int>(count) / samples;
  const auto planar = [&](const std::vector<Vec3>& vectors) {
    Tensor t(Shape{1, 3, rows, samples});
    for (std::size_t i = 0; i < count; ++i)
      for (int c = 0; c < 3; ++c) t.real[static_cast<std::size_t>(c) * count + i] = vectors[i][c];
    return t;
  };
  return {{"points", planar(rays.points)},
          {"directions", planar(rays.directions)},
          {"skip", Tensor::of_int({1, 1, rows, samples}, rays.skip)}};
}

int shade_stride(const LightTrainingOptions& options, int width, int height) {
  const int stride = width / options.shade_width;
  return stride * options.shade_width == width && stride * options.shade_height == height ? stride : 0;
}

LightBatch light_batch(const std::vector<std::shared_ptr<const LightView>>& views, const LightTrainingOptions& o,
                       const LightSampling& sampling, const std::vector<std::uint64_t>& keys) {
  LightBatch batch;
  for (std::size_t b = 0; b < views.size(); ++b) {
    const std::string at = std::to_string(b);
    const Prepared p = prepared(*views[b], o, sampling, keys[b]);
    Image seen = p.image;
    if (keyed_uniform(keys[b], 0, clip_draw) < sampling.clipped)
      for (float& v : seen.data) v = std::clamp(v, 0.f, 1.f);
    append(batch, "image", seen), append(batch, "albedo", p.albedo), append(batch, "normal", p.normal);
    append(batch, "material", p.material), append(batch, "depth", p.depth);
    append(batch, "camera", camera_tensor(std::span(&p.camera, 1)));
    append(batch, "range", depth_range(Tensor({1, 1, p.depth.height, p.depth.width}, p.depth.data)));
    put_rays(batch, p.rays, o.samples, at);
    if (o.weights.rerender > 0 && o.shade_width > 0) put_shading(batch, p, o, keys[b], at);
  }
  return batch;
}

}  // namespace clerestory
