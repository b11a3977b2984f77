#include "tracer/trace_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tracer/light_tables.hpp"

namespace clerestory {
namespace {

// Strides of kernels/trace/scene.clh and path.cl.
constexpr int kSurfaceSize = 32, kSampleSize = 8, kMapCount = 14;
// One launch traces at most this many samples of a pixel: sums in float stay exact enough, interrupts stay prompt.
constexpr int kPass = 64;
// And at most this many rays: grids of 65535 and more would be another variant to compile on PoCL.
constexpr int kRays = 32768;
// Points on lights beside a vertex's direction that its random numbers suffice for: BLOCKS of path.cl, less one.
constexpr int kMostLightSamples = 15;

void check(const World& scene) {
  const int materials = static_cast<int>(scene.materials.size()), emitters = static_cast<int>(scene.emitters.size());
  for (std::size_t i = 0; i < scene.triangles.size(); ++i) {
    const Triangle& t = scene.triangles[i];
    if (t.material < 0 || t.material >= materials || t.emitter < -1 || t.emitter >= emitters) {
      throw Error(ErrorKind::Failed, "material or emitter out of range", "triangle " + std::to_string(i));
    }
  }
  const Panorama& p = scene.panorama;
  if (p.rgb.size() != 3 * static_cast<std::size_t>(p.width) * p.height) {
    throw Error(ErrorKind::Failed, "size does not match its pixels", "panorama");
  }
  for (const Emitter& e : scene.emitters) {
    if (e.panorama && p.rgb.empty()) throw Error(ErrorKind::Failed, "a pane needs a panorama", "scene");
  }
}

void check_samples(int spp, int light_samples) {
  if (spp < 1) throw usage_error("at least one sample", "spp", std::to_string(spp), "1 or more");
  if (light_samples < 0 || light_samples > kMostLightSamples)
    throw usage_error("random numbers do not suffice for these", "light_samples", std::to_string(light_samples),
                      "0 to " + std::to_string(kMostLightSamples));
}

/// Texture coordinates of a triangle's plane: of each of the three a gradient and a constant.
void put_uvw(const Triangle& t, float* row) {
  const glm::dvec3 origin(t.v[0].position), first = glm::dvec3(t.v[1].position) - origin,
                                            second = glm::dvec3(t.v[2].position) - origin,
                                            normal = glm::cross(first, second);
  const double square = glm::dot(normal, normal);
  if (!(square > 0)) return;  // it is never hit
  const glm::dvec3 u = glm::cross(second, normal) / square, v = glm::cross(normal, first) / square;
  for (int k = 0; k < 3; ++k) {
    const auto at = [&](int corner) { return static_cast<double>(t.v[corner].uvw[k]); };
    const glm::dvec3 gradient = (at(1) - at(0)) * u + (at(2) - at(0)) * v;
    for (int axis = 0; axis < 3; ++axis) row[4 * k + axis] = static_cast<float>(gradient[axis]);
    row[4 * k + 3] = static_cast<float>(at(0) - glm::dot(gradient, origin));
  }
}

std::vector<float> pack_surfaces(const std::vector<Triangle>& triangles) {
  std::vector<float> packed(triangles.size() * kSurfaceSize, 0.f);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    float* row = &packed[i * kSurfaceSize];
    const glm::vec3 cross = glm::cross(t.v[1].position - t.v[0].position, t.v[2].position - t.v[0].position);
    const float length = glm::length(cross);
    const glm::vec3 normal = length > 0 ? cross / length : glm::vec3(0, 1, 0);  // without area it is never hit
    const auto put = [row](int at, const glm::vec3& v) { row[at] = v.x, row[at + 1] = v.y, row[at + 2] = v.z; };
    put(0, normal);
    row[3] = static_cast<float>(t.material), row[4] = static_cast<float>(t.emitter), row[5] = t.smooth ? 1.f : 0.f;
    put_uvw(t, row + 6);
    put(18, t.v[0].normal), put(21, t.v[1].normal - t.v[0].normal), put(24, t.v[2].normal - t.v[0].normal);
  }
  return packed;
}

std::span<const float> numbers_of(const std::vector<Material>& materials) {
  return {reinterpret_cast<const float*>(materials.data()), materials.size() * sizeof(Material) / sizeof(float)};
}

DroppedSamples count_dropped(const std::vector<float>& samples) {
  DroppedSamples dropped;
  for (std::size_t i = 0; i < samples.size() / kSampleSize; ++i) {
    const float* s = &samples[i * kSampleSize];
    if (s[6] > 0 && dropped.count == 0) dropped.pixel = static_cast<int>(i), dropped.sample = static_cast<int>(s[7]);
    dropped.count += static_cast<long>(s[6]);
  }
  return dropped;
}

std::array<float, 12> pose_rows(const std::array<double, 16>& m) {
  std::array<float, 12> rows{};
  std::transform(m.begin(), m.begin() + 12, rows.begin(), [](double v) { return static_cast<float>(v); });
  return rows;
}

std::array<float, 16> view_numbers(const Camera& camera) {
  camera.check("camera");
  std::array<float, 16> view{static_cast<float>(camera.fx), static_cast<float>(camera.fy),
                             static_cast<float>(camera.cx), static_cast<float>(camera.cy)};
  const std::array<float, 12> pose = pose_rows(camera.camera_to_world);
  std::copy(pose.begin(), pose.end(), view.begin() + 4);
  return view;
}

}  // namespace

TraceScene::TraceScene(const Device& device, const World& scene, Precision precision)
    : TraceScene(device, scene, precision, BvhForm::of(device)) {}

TraceScene::TraceScene(const Device& device, const World& scene, Precision precision, const BvhForm& form)
    : device_(device), precision_(precision), form_(form), triangle_count_(scene.triangles.size()) {
  check(scene);
  const LightTables light = make_light_tables(scene);
  Bvh bvh = build_bvh(scene.triangles, form);
  pane_leaf_ = append_leaves(bvh, scene.triangles, light.panes);
  pane_leaves_ = static_cast<int>(bvh.triangles.size()) / form.width - pane_leaf_;
  planes_ = upload(bvh.planes), children_ = upload(bvh.children);
  corners_ = upload(bvh.corners), triangles_ = upload(bvh.triangles);
  surfaces_ = upload(pack_surfaces(scene.triangles));
  materials_ = upload(numbers_of(scene.materials));
  panorama_ = upload(scene.panorama.rgb);
  panorama_width_ = scene.panorama.width, panorama_height_ = scene.panorama.height;
  panorama_turn_ = scene.panorama_turn / (2 * std::numbers::pi_v<float>);
  emitters_ = upload(light.emitters), lights_ = upload(light.lights);
  light_cdf_ = upload(light.cdf), sky_ = upload(light.sky);
  light_count_ = light.light_count(), sky_share_ = light.sky_share;
}

Buffer TraceScene::upload(std::span<const float> reals) {
  const Buffer buffer = allocate(reals.size());
  if (precision_ == Precision::Single) {
    device_.write(buffer, reals.data(), reals.size_bytes());
  } else {
    const std::vector<double> wide(reals.begin(), reals.end());
    device_.write(buffer, wide.data(), wide.size() * sizeof(double));
  }
  return buffer;
}

Buffer TraceScene::upload(std::span<const std::int32_t> numbers) {
  const Buffer buffer = device_.allocate(numbers.size_bytes());
  device_.write(buffer, numbers.data(), numbers.size_bytes());
  return buffer;
}

Buffer TraceScene::allocate(std::size_t reals) { return device_.allocate(reals * real_size(precision_)); }

std::vector<float> TraceScene::download(const Buffer& buffer, std::size_t reals) {
  std::vector<float> values(reals);
  if (precision_ == Precision::Single) {
    device_.read(buffer, values.data(), reals * sizeof(float));
  } else {
    std::vector<double> wide(reals);
    device_.read(buffer, wide.data(), reals * sizeof(double));
    std::ranges::transform(wide, values.begin(), [](double v) { return static_cast<float>(v); });
  }
  return values;
}

Kernel TraceScene::kernel(const char* name) {
  return device_.kernel("trace/path.cl", name, form_.defines(), precision_);
}

std::vector<Arg> TraceScene::arguments(std::initializer_list<Arg> own) const {
  std::vector<Arg> all = {planes_,          children_,      corners_,   triangles_, surfaces_,    materials_,
                          emitters_,        lights_,        light_cdf_, panorama_,  light_count_, panorama_width_,
                          panorama_height_, panorama_turn_, sky_,       sky_share_, pane_leaf_,   pane_leaves_};
  all.insert(all.end(), own);
  return all;
}

TraceMaps TraceScene::maps(const Camera& camera) {
  const std::array<float, 16> view = view_numbers(camera);
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
  const Buffer out = allocate(pixels * kMapCount), on_device = upload(view);
  const std::vector<Arg> args = arguments({on_device, camera.width, camera.height, out});
  const Range range = form_.range(static_cast<std::size_t>(camera.width), static_cast<std::size_t>(camera.height));
  device_.launch_with(kernel("trace_maps"), range, args);
  const std::vector<float> values = download(out, pixels * kMapCount);

  TraceMaps maps;
  std::size_t at = 0;
  const auto take = [&](Image& image, int channels) {
    image = Image(camera.width, camera.height, channels);
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(at);
    std::copy(from, from + static_cast<std::ptrdiff_t>(image.data.size()), image.data.begin());
    at += image.data.size();
  };
  take(maps.depth, 1), take(maps.normal, 3), take(maps.albedo, 3), take(maps.roughness, 1), take(maps.metallic, 1);
  take(maps.emission, 3);
  for (std::vector<int>* numbers : {&maps.emitter, &maps.triangle}) {
    numbers->resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i) (*numbers)[i] = static_cast<int>(values[at + i]);
    at += pixels;
  }
  return maps;
}

TracePicture TraceScene::picture(const Camera& camera, int spp, std::uint32_t seed, int max_depth, int light_samples,
                                 float most_indirect) {
  check_samples(spp, light_samples);
  const std::array<float, 16> view = view_numbers(camera);
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
  const Buffer on_device = upload(view), out = allocate(pixels * kSampleSize);
  const Kernel trace = kernel("trace_view");
  const Range range = form_.range(static_cast<std::size_t>(camera.width), static_cast<std::size_t>(camera.height));
  // Mean, and squared differences from it, of the passes so far (Chan et al. 1983).
  std::vector<double> means(pixels * 3, 0.0), squares(pixels * 3, 0.0);
  std::vector<long> kept(pixels, 0);
  TracePicture picture;
  for (int first = 0; first < spp; first += kPass) {
    const int count = std::min(kPass, spp - first);
    const std::vector<Arg> args = arguments(
        {on_device, camera.width, camera.height, seed, first, count, light_samples, max_depth, most_indirect, out});
    device_.launch_with(trace, range, args);
    const std::vector<float> pass = download(out, pixels * kSampleSize);
    const DroppedSamples dropped = count_dropped(pass);
    if (picture.dropped.count == 0)
      picture.dropped = dropped;
    else
      picture.dropped.count += dropped.count;
    for (std::size_t i = 0; i < pixels; ++i) {
      const float* s = &pass[i * kSampleSize];
      const long more = count - static_cast<long>(s[6]), all = kept[i] + more;
      if (more == 0) continue;
      const double share = static_cast<double>(more) / static_cast<double>(all);
      for (std::size_t c = 0; c < 3; ++c) {
        const double off = static_cast<double>(s[c]) / static_cast<double>(more) - means[i * 3 + c];
        means[i * 3 + c] += share * off;
        squares[i * 3 + c] += static_cast<double>(s[3 + c]) + off * off * share * static_cast<double>(kept[i]);
      }
      kept[i] = all;
    }
  }
  picture.mean = Image(camera.width, camera.height, 3);
  picture.variance = Image(camera.width, camera.height, 3);
  for (std::size_t i = 0; i < pixels; ++i) {
    const double n = static_cast<double>(kept[i]);
    for (std::size_t c = 0; c < 3; ++c) {
      picture.mean.data[c * pixels + i] = static_cast<float>(means[i * 3 + c]);
      picture.variance.data[c * pixels + i] = n > 1 ? static_cast<float>(squares[i * 3 + c] / n / (n - 1)) : 0.f;
    }
  }
  return picture;
}

void TraceScene::radiance(const Buffer& points, const Buffer& directions, const Buffer& out, int count, int stride,
                          const RadianceQuery& query, DroppedSamples* dropped) {
  check_samples(query.spp, query.light_samples);
  const std::array<float, 12> pose = pose_rows(query.to_world);
  const Buffer pose_on_device = upload(pose);
  const std::size_t reals = static_cast<std::size_t>(std::min(count, kRays)) * kSampleSize;
  if (!samples_ || samples_.bytes() < reals * real_size(precision_)) samples_ = allocate(reals);
  const Kernel trace = kernel("trace_rays"), mean = kernel("mean_radiance");
  if (dropped) *dropped = {};
  for (int at = 0; at < count; at += kRays) {
    const int rays = std::min(kRays, count - at);
    const std::vector<Arg> args = arguments({points, directions, at, stride, rays, pose_on_device, query.seed, 0,
                                             query.spp, query.emitters ? 1 : 0, query.light_samples, query.max_depth,
                                             query.most_indirect, query.spread, samples_});
    device_.launch_with(trace, form_.range(static_cast<std::size_t>(rays)), args);
    device_.launch(mean, Range::of(static_cast<std::size_t>(rays)), samples_, rays, query.spp, at, stride, out);
    if (!dropped) continue;
    DroppedSamples part = count_dropped(download(samples_, static_cast<std::size_t>(rays) * kSampleSize));
    if (part.count > 0) part.pixel += at;
    if (dropped->count == 0)
      *dropped = part;
    else
      dropped->count += part.count;
  }
}

std::vector<float> TraceScene::radiance(const std::vector<float>& points, const std::vector<float>& directions,
                                        const RadianceQuery& query, DroppedSamples* dropped) {
  const Buffer out = allocate(points.size());
  const int count = static_cast<int>(points.size() / 3);
  radiance(upload(points), upload(directions), out, count, count, query, dropped);
  return download(out, points.size());
}

std::vector<TraceHit> TraceScene::hits(const std::vector<float>& points, const std::vector<float>& directions,
                                       float t_min, float t_max) {
  const int count = static_cast<int>(points.size() / 3);
  const Buffer out = allocate(static_cast<std::size_t>(count) * 4), from = upload(points), to = upload(directions);
  const std::vector<Arg> args = arguments({from, to, count, t_min, t_max, out});
  device_.launch_with(kernel("trace_hits"), form_.range(static_cast<std::size_t>(count)), args);
  const std::vector<float> values = download(out, static_cast<std::size_t>(count) * 4);
  std::vector<TraceHit> hits(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < hits.size(); ++i) {
    hits[i] = {values[4 * i], values[4 * i + 1], values[4 * i + 2], static_cast<int>(values[4 * i + 3])};
  }
  return hits;
}

}  // namespace clerestory
