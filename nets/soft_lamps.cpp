#include "nets/soft_lamps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "host/math/panorama.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/soft_lamps.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/stopwatch.hpp"
#include "nets/scene_light.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

constexpr int kGrid = 40;     // pixels along the picture's longer side that are explained
constexpr int kSamples = 64;  // directions from each, but for a fixed grid of them
// Candidates stand in a lattice of directions around the camera, at these shares of how far the picture sees; each is
// as large as the gap to its neighbours.
constexpr int kDirections = 96;
constexpr std::array kDistances{0.4, 0.8, 1.3};
constexpr double kSize = 0.3;      // of a candidate's distance
constexpr double kNothing = 1e-3;  // of all lamps' light: a lamp that adds less is left out
constexpr int kSweeps = 2000;
constexpr double kConverged = 1e-7;  // of the largest amplitude

using Rgb = std::array<double, 3>;

/// Wherever the picture does not look.
std::vector<SoftLamp> candidates(const Scene& scene) {
  const std::vector<float>& depth = scene.depth.data;
  std::vector<float> seen;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(seen), [](float z) { return z > 0; });
  const double far = quantile(std::span<const float>(seen), 0.9);
  std::vector<SoftLamp> lamps;
  for (int i = 0; i < kDirections; ++i) {
    const Vec3 d = lattice_direction(i, kDirections);
    const std::optional<Vec2> at = scene.camera.project(d);
    if (at && at->x >= 0 && at->y >= 0 && at->x < scene.width() && at->y < scene.height()) continue;
    for (const double distance : kDistances) lamps.push_back({distance * far * d, kSize * distance * far, {}});
  }
  return lamps;
}

/// The coarse grid of pixels, and the layer's answers there.
struct Explained {
  Image photo, counts;          // counts: 1 where a pixel is to be explained
  std::vector<float> radiance;  // of the light alone, {3, pixels}
  std::vector<float> shares;    // of each candidate, {pixels, 3, candidates}: radiance for one unit
  std::size_t pixels() const { return photo.pixels(); }
};

Tensor places_of(const std::vector<SoftLamp>& lamps) {
  const int count = static_cast<int>(lamps.size());
  Tensor places(Shape{1, 4, 1, count});
  for (int k = 0; k < count; ++k) {
    const SoftLamp& lamp = lamps[static_cast<std::size_t>(k)];
    for (int c = 0; c < 3; ++c) places.at(0, c, 0, k) = lamp.place[c];
    places.at(0, 3, 0, k) = lamp.size;
  }
  return places;
}

Tensor colors_of(const std::vector<SoftLamp>& lamps) {
  const int count = static_cast<int>(lamps.size());
  Tensor colors(Shape{1, 3, 1, count});
  for (int k = 0; k < count; ++k)
    for (int c = 0; c < 3; ++c)
      colors.at(0, c, 0, k) = lamps[static_cast<std::size_t>(k)].radiance[static_cast<std::size_t>(c)];
  return colors;
}

Explained explain(Device& device, const Scene& scene, RenderSettings settings, const std::vector<SoftLamp>& lamps) {
  settings.lamps.clear();
  const int stride = std::max(1, std::max(scene.width(), scene.height()) / kGrid), first = stride / 2;
  const auto coarse = [&](const Image& map) { return every_nth(map, stride, first, first); };
  const Camera camera = every_nth(scene.camera, stride, first, first);
  const Image depth = coarse(scene.depth), albedo = coarse(scene.albedo), normal = coarse(scene.normal),
              material = coarse(scene.material);
  const int pixels = camera.width * camera.height;

  Graph graph;
  const SceneValues v = scene_values(graph, scene);
  const SceneLight light = scene_light(graph, v, scene, settings);
  const RenderSpec spec = render_spec(settings);
  const auto map = [&](const char* name, const Image& image) {
    return graph.input(name, {1, image.channels, image.height, image.width});
  };
  const Value z = map("grid depth", depth), eye = graph.input("grid camera", {1, 4, 1, 1});
  const Surfaces surfaces{map("grid albedo", albedo), map("grid normal", normal), map("grid material", material)};
  // The sampler that renders; the grid's directions are no samples, and there is no leaving out any.
  SamplingOptions sampling = spec.sampling;
  sampling.lobes = true;
  const int samples = sampling.sampler == Sampler::Grid8x16 ? spec.spp : kSamples;
  const BrdfSamples drawn = sample_brdf(z, eye, surfaces, surfaces, pixels, samples, sampling);
  const Value points = surface_points(z, eye), row_points = reshape(points, {1, 3, pixels, 1});
  const Value starts = ray_origins(points, samples);
  const Value skip = graph.input("grid skip", {1, 1, pixels, samples}, Type::Int);
  const SsrtHits hits = ssrt(ssrt_scene(v.maps.depth, v.maps.surfaces.normal), v.camera, v.range, drawn.direction,
                             {starts, skip}, spec.ssrt);
  const Value radiance =
      light.radiance({row_points, drawn.direction, drawn.lobes, hits, v.camera}, light.inputs, nullptr);
  const Value alone = accumulate_samples(drawn.weight, radiance, drawn.pdf, {}, {}, samples).mean;
  const Value shares = scale(
      weigh_lamps(drawn.weight, {row_points, drawn.direction, hits.u, drawn.lobes}, graph.constant(places_of(lamps))),
      1.0 / samples);

  Executor executor(compile(graph, {alone, shares, drawn.status}, device, {.precision = settings.precision}),
                    light.states);
  feed_scene(executor, scene);
  light.feed(executor);
  executor.feed("grid depth", tensor_of(depth)), executor.feed("grid albedo", tensor_of(albedo));
  executor.feed("grid normal", tensor_of(normal)), executor.feed("grid material", tensor_of(material));
  executor.feed("grid camera", camera_tensor(std::span(&camera, 1)));
  std::vector<int> own;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      own.insert(own.end(), static_cast<std::size_t>(samples),
                 (stride * y + first) * scene.width() + stride * x + first);
  executor.feed("grid skip", Tensor::of_int({1, 1, pixels, samples}, std::move(own)));
  executor.run(settings.seed);

  Explained e{coarse(scene.photo), Image(camera.width, camera.height, 1), executor.fetch_floats(alone),
              executor.fetch_floats(shares)};
  const std::vector<float> status = executor.fetch_floats(drawn.status);
  // What the layer drops says nothing: one such pixel would take all lamps away.
  const auto finite = [](std::span<const float> values) {
    return std::ranges::all_of(values, [](float x) { return std::isfinite(x); });
  };
  const std::size_t of_pixel = 3 * lamps.size();
  for (std::size_t i = 0; i < e.pixels(); ++i) {
    const std::array<float, 3> lit{e.radiance[i], e.radiance[e.pixels() + i], e.radiance[2 * e.pixels() + i]};
    e.counts.data[i] = status[i] == 0 && material.plane(2)[i] == 0 && finite(lit) &&
                       finite(std::span(e.shares).subspan(i * of_pixel, of_pixel));
  }
  return e;
}

/// Minimum over a >= 0 of |A a - t|^2 + ridge m |a|^2, m the mean of A's squared columns: coordinate descent over the
/// normal equations, in double.
std::vector<double> non_negative_least_squares(const std::vector<double>& rows, const std::vector<double>& target,
                                               std::size_t unknowns, double ridge) {
  std::vector<double> gram(unknowns * unknowns, 0), slope(unknowns, 0), a(unknowns, 0);
  for (std::size_t i = 0; i < target.size(); ++i) {
    const double* row = rows.data() + i * unknowns;
    for (std::size_t k = 0; k < unknowns; ++k) {
      slope[k] -= row[k] * target[i];
      for (std::size_t j = 0; j < unknowns; ++j) gram[k * unknowns + j] += row[k] * row[j];
    }
  }
  double trace = 0;
  for (std::size_t k = 0; k < unknowns; ++k) trace += gram[k * unknowns + k];
  if (trace <= 0) return a;
  for (std::size_t k = 0; k < unknowns; ++k) gram[k * unknowns + k] += ridge * trace / static_cast<double>(unknowns);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double moved = 0, largest = 0;
    for (std::size_t k = 0; k < unknowns; ++k) {  // slope is that of half the sum of squares at a
      const double next = std::max(0.0, a[k] - slope[k] / gram[k * unknowns + k]), step = next - a[k];
      largest = std::max(largest, next), moved = std::max(moved, std::abs(step));
      if (step == 0) continue;
      a[k] = next;
      for (std::size_t j = 0; j < unknowns; ++j) slope[j] += step * gram[k * unknowns + j];
    }
    if (moved <= kConverged * largest) break;
  }
  return a;
}

/// One channel's problem: rows and target of the pixels that count, each over its brightness.
struct Problem {
  std::vector<double> rows, target;
  double sum_of_squares(const std::vector<double>& a) const {
    double sum = 0;
    for (std::size_t i = 0; i < target.size(); ++i) {
      double error = -target[i];
      for (std::size_t k = 0; k < a.size(); ++k) error += rows[i * a.size() + k] * a[k];
      sum += error * error;
    }
    return sum;
  }
};

Problem problem_of(const Explained& e, std::size_t channel, std::size_t unknowns, const FitWeights& weights,
                   double& missing) {
  const std::size_t n = e.pixels();
  const float* photo = e.photo.plane(static_cast<int>(channel));
  double whole = 0, count = 0, dark = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (e.counts.data[i] != 0) whole += static_cast<double>(photo[i]), count += 1;
  Problem p;
  if (whole <= 0) return p;
  for (std::size_t i = 0; i < n; ++i) {
    if (e.counts.data[i] == 0) continue;
    const auto seen = static_cast<double>(photo[i]), lit = static_cast<double>(e.radiance[channel * n + i]);
    const double weight = weight_of_pixel(seen, whole / count, weights);
    const float* shares = e.shares.data() + (i * 3 + channel) * unknowns;
    for (std::size_t k = 0; k < unknowns; ++k) p.rows.push_back(weight * static_cast<double>(shares[k]));
    p.target.push_back(weight * (seen - lit));
    dark += std::max(0.0, seen - lit);
  }
  missing = dark / whole;
  return p;
}

/// Lamps whose light matters, beside that of all.
std::vector<SoftLamp> that_matter(const std::vector<SoftLamp>& all) {
  const auto light = [](const SoftLamp& l) { return l.radiance[0] + l.radiance[1] + l.radiance[2]; };
  double sum = 0;
  for (const SoftLamp& l : all) sum += light(l);
  std::vector<SoftLamp> kept;
  std::copy_if(all.begin(), all.end(), std::back_inserter(kept),
               [&](const SoftLamp& l) { return light(l) > kNothing * sum; });
  return kept;
}

}  // namespace

double weight_of_pixel(double seen, double mean, const FitWeights& fit) { return 1 / (seen + fit.floor * mean); }

SceneLight with_lamps(Graph& graph, SceneLight light, const std::vector<SoftLamp>& lamps) {
  if (lamps.empty()) return light;
  const std::size_t own = light.inputs.size();
  light.inputs.push_back(graph.constant(places_of(lamps))), light.inputs.push_back(graph.constant(colors_of(lamps)));
  light.traces = light.lamps = true;
  light.radiance = [own, alone = light.radiance](const AskedRays& rays, std::span<const Value> in, RayCounts* counts) {
    return add_lamps(alone(rays, in.first(own), counts), {rays.points, rays.direction, rays.hits.u, rays.lobes},
                     in[own], in[own + 1]);
  };
  return light;
}

LampFit fit_lamps(Device& device, const Scene& scene, const RenderSettings& settings) {
  const Stopwatch watch;
  LampFit fit;
  std::vector<SoftLamp> all = candidates(scene);
  fit.candidates = all.size();
  if (all.empty()) return fit;  // a picture of every direction hides nothing
  const Explained e = explain(device, scene, settings, all);
  double before = 0, after = 0, equations = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const Problem p = problem_of(e, c, all.size(), settings.fit, fit.missing[c]);
    const std::vector<double> a = non_negative_least_squares(p.rows, p.target, all.size(), settings.fit.ridge);
    before += p.sum_of_squares(std::vector<double>(all.size(), 0)), after += p.sum_of_squares(a);
    equations += static_cast<double>(p.target.size());
    for (std::size_t k = 0; k < all.size(); ++k) all[k].radiance[c] = a[k];
  }
  fit.lamps = that_matter(all);
  if (equations > 0) fit.before = std::sqrt(before / equations), fit.after = std::sqrt(after / equations);
  fit.seconds = watch.seconds();
  return fit;
}

}  // namespace clerestory
