// The layer end to end: analytic means, standard errors, chunks, dropped samples, light from the host.
#include "host/ops/shade/render.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "checks/op_case.hpp"
#include "checks/shade/surface_reference.hpp"
#include "host/graph/plan.hpp"
#include "host/math/frames.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/bench_room.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/ops/shade/wall.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

struct Picture {
  Tensor radiance, standard_error, uncertainty, status, tally;
};

struct Layer {
  Graph graph;
  Rendered rendered;
  std::unique_ptr<Executor> executor;

  Layer(const Tensors& t, RenderSpec spec, const std::string& light, bool other_sampling = false, bool guided = false) {
    if (guided)  // above the wall's left half, before its right one
      spec.lamps =
          graph.constant(Tensor({1, 5, 1, 2}, std::vector<double>{-0.4, 0.5, 0.8, 0, -1, -1, 0.2, 0.5, 20, 1}));
    const auto in = [&](const std::string& name) { return graph.input(name, t.at(name).shape); };
    const SurfaceMaps maps{in("depth"), {in("albedo"), in("normal"), in("material")}};
    const Value camera = in("camera"), range = in("range"), ambient = in("ambient"), image = in("image");
    const std::vector<Value> both{image, ambient}, one{ambient};
    const Surfaces sampling =
        other_sampling ? Surfaces{maps.surfaces.albedo, maps.surfaces.normal, in("s_material")} : Surfaces{};
    if (light == "constant") rendered = render(graph, spec, maps, camera, range, one, constant_answers, {}, sampling);
    if (light == "image") rendered = render(graph, spec, maps, camera, range, both, image_answers, {}, sampling);
    if (light == "panorama") rendered = render(graph, spec, maps, camera, range, both, panorama_answers, {}, sampling);
    executor = std::make_unique<Executor>(compile(
        graph, {rendered.radiance, rendered.standard_error, rendered.uncertainty, rendered.status, rendered.tally},
        test_device()));
    for (const auto& [name, tensor] : t)
      if (other_sampling || name != "s_material") executor->feed(name, tensor);
  }
  Picture run(std::uint32_t seed) {
    executor->run(seed);
    return {executor->fetch(rendered.radiance), executor->fetch(rendered.standard_error),
            executor->fetch(rendered.uncertainty), executor->fetch(rendered.status), executor->fetch(rendered.tally)};
  }
};

// Under the same light from everywhere a pixel shows ambient times its directional albedo, whatever draws the samples.
TEST(Render, ConstantLightGivesTheDirectionalAlbedo) {
  const int w = 8, h = 6;
  for (const double metallic : {0.0, 1.0}) {
    Tensors t = wall(w, h, 0.5, metallic);
    t["s_material"] = t["material"];
    for (double& x : t["s_material"].real) x = 0.75 * x + 0.2;
    std::vector<Vec3> truth;
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        const SurfaceReference s{
            {t["albedo"].at(0, 0, y, x), t["albedo"].at(0, 1, y, x), t["albedo"].at(0, 2, y, x)}, 0.5, metallic};
        const Vec3 view = -Camera::from_fov(w, h, 70.0).direction(x + 0.5, y + 0.5);
        const Vec3 n{t["normal"].at(0, 0, y, x), t["normal"].at(0, 1, y, x), t["normal"].at(0, 2, y, x)};
        truth.push_back(s.directional_albedo(frame_around(n).to_local(view), 400, 64));
      }
    for (const char* name :
         {"vndf_caps", "vndf_hemisphere", "vndf_bounded", "ndf", "cosine", "uniform", "detached", "guided"}) {
      const bool detached = std::string(name) == "detached", guided = std::string(name) == "guided";
      RenderSpec spec{.spp = 1024, .trace = false};
      spec.sampling = {.sampler = detached || guided ? Sampler::VndfCaps : sampler_of(name),
                       .points = Points::Independent};
      const Picture p = Layer(t, spec, "constant", detached, guided).run(4);
      // All pixels together: a pixel's own error is small by luck where none of its few directions below the surface
      // fell.
      double difference = 0, variance = 0;
      for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
          for (int c = 0; c < 3; ++c) {
            difference +=
                p.radiance.at(0, c, y, x) - truth[static_cast<std::size_t>(y * w + x)][c] * t["ambient"].at(0, c, 0, 0);
            variance += 3 * std::pow(p.standard_error.at(0, c, y, x), 2);  // channels of a pixel move together
          }
      // 4 standard errors, and the quadrature's 1e-4 a value.
      EXPECT_NEAR(difference, 0, 4 * std::sqrt(variance) + 1e-4 * 3 * w * h) << name << ", metallic " << metallic;
      EXPECT_LT(std::sqrt(variance), 0.01 * 3 * w * h) << name << ": the test sees nothing";
    }
  }
}

// The default: Sobol's points. What a pixel's samples say of its error is no bound for them, so that means of whole
// pictures over seeds, which are independent, are judged by their own spread.
TEST(Render, ConstantLightGivesTheDirectionalAlbedoWithTheDefaultPoints) {
  const int w = 8, h = 6, seeds = 16;
  ASSERT_EQ(RenderSpec{}.sampling.points, Points::Sobol);
  for (const double metallic : {0.0, 0.4, 1.0}) {
    const Tensors t = wall(w, h, 0.5, metallic);
    double truth = 0;
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        const SurfaceReference s{
            {t.at("albedo").at(0, 0, y, x), t.at("albedo").at(0, 1, y, x), t.at("albedo").at(0, 2, y, x)},
            0.5,
            metallic};
        const Vec3 view = -Camera::from_fov(w, h, 70.0).direction(x + 0.5, y + 0.5);
        const Vec3 n{t.at("normal").at(0, 0, y, x), t.at("normal").at(0, 1, y, x), t.at("normal").at(0, 2, y, x)};
        const Vec3 albedo = s.directional_albedo(frame_around(n).to_local(view), 400, 64);
        for (int c = 0; c < 3; ++c) truth += albedo[c] * t.at("ambient").at(0, c, 0, 0) / (3 * w * h);
      }
    for (const Sampler sampler : {Sampler::VndfCaps, Sampler::VndfHemisphere, Sampler::VndfBounded, Sampler::Ndf}) {
      RenderSpec spec{.spp = 256, .trace = false};
      spec.sampling.sampler = sampler;
      Layer layer(t, spec, "constant");
      std::vector<double> means;
      for (std::uint32_t seed = 0; seed < seeds; ++seed) means.push_back(mean(layer.run(seed).radiance.real));
      const double error = standard_deviation(means) / std::sqrt(seeds);
      // Of Student's t with 15 degrees of freedom 5.2 deviations leave 1e-4; the quadrature is good to 1e-4.
      EXPECT_NEAR(mean(means), truth, 5.2 * error + 1e-4)
          << "sampler " << static_cast<int>(sampler) << ", metallic " << metallic;
      EXPECT_LT(error, 1e-3 * truth) << "the test sees nothing";
    }
  }
}

// A Lambertian surface drawn by cosine has no spread but its specular part's; here the specular part is known to be the
// only difference from albedo * ambient, and Sobol's points leave less of it than independent ones.
TEST(Render, SobolPointsSpreadLess) {
  const int w = 16, h = 12, seeds = 12;
  const Tensors t = wall(w, h, 0.4, 0.0);
  double spread[2];
  for (const Points points : {Points::Independent, Points::Sobol}) {
    RenderSpec spec{.spp = 64};
    spec.sampling.points = points;
    Layer layer(t, spec, "image");
    Tensor sum(Shape{1, 3, h, w}), squares(Shape{1, 3, h, w});
    for (int s = 0; s < seeds; ++s) {
      const Picture p = layer.run(static_cast<std::uint32_t>(s));
      for (std::size_t i = 0; i < sum.real.size(); ++i)
        sum.real[i] += p.radiance.real[i], squares.real[i] += std::pow(p.radiance.real[i], 2);
    }
    double total = 0;
    for (std::size_t i = 0; i < sum.real.size(); ++i)
      total += (squares.real[i] - sum.real[i] * sum.real[i] / seeds) / (seeds - 1);
    spread[points == Points::Sobol] = total;
  }
  EXPECT_LT(spread[1], 0.8 * spread[0]);
}

/// Variances of a pixel's mean over seeds, and what the layer states of them, by channel and pixel.
struct Spread {
  std::vector<double> seen, stated;
  double share() const {  // of all pixels together
    return std::accumulate(seen.begin(), seen.end(), 0.0) / std::accumulate(stated.begin(), stated.end(), 0.0);
  }
};

Spread spread_over_seeds(const Tensors& t, const RenderSpec& spec, int seeds) {
  Layer layer(t, spec, "image");
  std::vector<std::vector<double>> means(t.at("albedo").real.size());
  Spread spread{{}, std::vector<double>(means.size(), 0)};
  for (int s = 0; s < seeds; ++s) {
    const Picture p = layer.run(static_cast<std::uint32_t>(100 + s));
    for (std::size_t i = 0; i < means.size(); ++i) {
      means[i].push_back(p.radiance.real[i]);
      spread.stated[i] += std::pow(p.standard_error.real[i], 2) / seeds;
    }
  }
  for (const std::vector<double>& m : means) spread.seen.push_back(std::pow(standard_deviation(m), 2));
  return spread;
}

TEST(Render, StandardErrorIsTheSpreadOverSeeds) {
  const Tensors t = wall(12, 8, 0.6, 0.3);
  for (const int chunk_rays : {1 << 18, 32}) {  // one chunk of samples, and two
    RenderSpec spec{.spp = 64, .chunk_rays = chunk_rays};
    spec.sampling.points = Points::Independent;
    // 288 variances of 48 values each, channels of a pixel in step: the ratio has a deviation of about 3 %.
    EXPECT_NEAR(spread_over_seeds(t, spec, 48).share(), 1, 0.12) << chunk_rays;
  }
}

// Sobol's points leave less than independent ones would, which is what is stated: a bound, and as loose as it is said
// to be.
TEST(Render, StandardErrorBoundsTheSpreadOfSobolPoints) {
  const int seeds = 48;
  const Tensors t = wall(12, 8, 0.6, 0.3);
  for (const auto& [spp, said] : {std::pair{64, 0.57}, {256, 0.43}}) {
    const Spread spread = spread_over_seeds(t, {.spp = spp}, seeds);
    // The largest of 288 variances of `seeds` values, were all spreads as stated: chi-square over its 47 degrees of
    // freedom passes 2.4 once in a million.
    std::vector<double> ratios;
    for (std::size_t i = 0; i < spread.seen.size(); ++i) {
      EXPECT_LT(spread.seen[i], 2.4 * spread.stated[i]) << i;
      ratios.push_back(std::sqrt(spread.seen[i] / spread.stated[i]));
    }
    // A deviation of 48 values is good to 10 %, the median of 96 pixels to 1.3 %: four of them, and the last digit.
    EXPECT_NEAR(quantile(std::span<const double>(ratios), 0.5), said, 0.052 * said + 0.005) << spp;
    EXPECT_LT(spread.share(), 0.9) << spp;
  }
}

TEST(Render, ChunksDoNotMatter) {
  Tensors t = wall(19, 11, 0.3, 0.2, 2);
  t["depth"].at(0, 0, 3, 4) = 0;     // not shaded: without depth,
  t["normal"].at(1, 2, 5, 16) = -1;  // facing away
  RenderSpec spec{.spp = 40};
  const Picture whole = Layer(t, spec, "image").run(7);
  spec.chunk_rays = 48 * 17;  // 17 pixels a chunk, which no row or picture is a multiple of
  const Picture tiles = Layer(t, spec, "image").run(7);
  EXPECT_EQ(whole.radiance.real, tiles.radiance.real);
  EXPECT_EQ(whole.standard_error.real, tiles.standard_error.real);
  EXPECT_EQ(whole.uncertainty.real, tiles.uncertainty.real);
  spec.chunk_rays = 16;  // a pixel's samples in three chunks: another order of sums, eight roundings or so
  const Picture slices = Layer(t, spec, "image").run(7);
  for (const Picture& p : {whole, tiles, slices}) {
    EXPECT_EQ(p.status.real, whole.status.real);
    EXPECT_EQ(render_counts(p.status, p.tally).without_depth, 1);
    EXPECT_EQ(render_counts(p.status, p.tally).facing_away, 1);
    EXPECT_EQ(render_counts(p.status, p.tally).directions, render_counts(whole.status, whole.tally).directions);
  }
  for (std::size_t i = 0; i < whole.radiance.real.size(); ++i)
    ASSERT_NEAR(whole.radiance.real[i], slices.radiance.real[i], 8 * 1.2e-7 * std::max(1.0, whole.radiance.real[i]));
  for (std::size_t i = 0; i < whole.uncertainty.real.size(); ++i)
    ASSERT_NEAR(whole.uncertainty.real[i], slices.uncertainty.real[i], 8 * 1.2e-7);
}

TEST(Render, CountsAndUncertainty) {
  const int w = 20, h = 14;
  Tensors t = wall(w, h, 0.5, 0);
  t["depth"].at(0, 0, 3, 4) = 0;
  t["normal"].at(0, 0, 5, 6) = 0, t["normal"].at(0, 2, 5, 6) = -1;
  t["normal"].at(0, 0, 7, 8) = 0, t["normal"].at(0, 2, 7, 8) = 0;  // a zero normal faces nobody
  const Picture p = Layer(t, {.spp = 32}, "image").run(1);
  const RenderCounts counts = render_counts(p.status, p.tally);
  EXPECT_EQ(counts.without_depth, 1);
  EXPECT_EQ(counts.facing_away, 2);
  EXPECT_EQ(counts.shaded, w * h - 3);
  EXPECT_EQ(counts.dropped, 0);
  EXPECT_FALSE(counts.first_dropped);
  EXPECT_GT(counts.hits, 0);
  EXPECT_LT(counts.hits, counts.directions);
  EXPECT_LE(counts.directions, 32.0 * (w * h - 3));
  EXPECT_EQ(p.status.at(0, 0, 3, 4), 1);
  EXPECT_EQ(p.status.at(0, 0, 5, 6), 2);
  for (const auto& [y, x] : {std::pair{3, 4}, {5, 6}, {7, 8}})
    for (int c = 0; c < 3; ++c) EXPECT_EQ(p.radiance.at(0, c, y, x), 0);
  // Pixels far from the step see no surface: every ray leaves, and is wholly uncertain.
  EXPECT_NEAR(p.uncertainty.at(0, 0, 2, w - 2), 1, 8 * 1.2e-7);
  for (const double u : p.uncertainty.real) ASSERT_TRUE(u >= 0 && u <= 1 + 8 * 1.2e-7);
}

TEST(Render, DropsWhatIsNotFiniteAndNamesTheFirst) {
  Tensors t = wall(10, 6, 0.5, 0);
  t["albedo"].at(0, 1, 2, 3) = NAN;
  t["ambient"].at(0, 2, 0, 0) = INFINITY;  // every ray of every pixel misses on some sample
  const Picture p = Layer(t, {.spp = 16}, "image").run(1);
  for (const double x : p.radiance.real) ASSERT_TRUE(std::isfinite(x));
  for (const double x : p.standard_error.real) ASSERT_TRUE(std::isfinite(x));
  const RenderCounts counts = render_counts(p.status, p.tally);
  EXPECT_GT(counts.dropped, 0);
  ASSERT_TRUE(counts.first_dropped);
  EXPECT_EQ(counts.first_dropped->pixel, 0);

  t["ambient"].at(0, 2, 0, 0) = 1;
  const Picture q = Layer(t, {.spp = 16}, "image").run(1);
  const RenderCounts one = render_counts(q.status, q.tally);
  EXPECT_EQ(one.dropped, q.tally.at(0, 1, 2, 3));  // every direction of that pixel
  EXPECT_GT(one.dropped, 0);
  ASSERT_TRUE(one.first_dropped);
  EXPECT_EQ(one.first_dropped->pixel, 2 * 10 + 3);
  EXPECT_TRUE(one.first_dropped->sample >= 0 && one.first_dropped->sample < 16);

  // A lobe without a width, and a normal of infinite length, about which directions are no numbers: dropped and
  // counted.
  t["albedo"].at(0, 1, 2, 3) = 0.5, t["material"].at(0, 0, 4, 5) = NAN, t["normal"].at(0, 2, 5, 6) = INFINITY;
  const Picture r = Layer(t, {.spp = 16}, "image").run(1);
  const RenderCounts wide = render_counts(r.status, r.tally);
  EXPECT_EQ(r.tally.at(0, 1, 4, 5), 16);  // directions: none is passed over
  EXPECT_EQ(r.tally.at(0, 1, 5, 6), 16);
  EXPECT_EQ(wide.dropped, 32);
  ASSERT_TRUE(wide.first_dropped);
  EXPECT_EQ(wide.first_dropped->pixel, 4 * 10 + 5);
  for (const double x : r.radiance.real) ASSERT_TRUE(std::isfinite(x));
}

Tensor tally_of_pixel(const Tensor& tally, int pixel) {
  Tensor one({1, tally.shape.c, 1, 1});
  for (int c = 0; c < tally.shape.c; ++c) one.at(0, c, 0, 0) = tally.at(0, c, 0, pixel);
  return one;
}

/// ln(edge - x): no number for directions far to the right.
LightBuilder light_with_a_hole(double edge) {
  return [edge](Graph&, const RayBatch& rays, std::span<const Value>) {
    const Value left = activate(affine(slice(rays.direction, 0, 1), -1, edge), Function::Log);
    return concat(std::vector{left, left, left});
  };
}

// However samples are cut into chunks, and whichever of these drop some: the first sample of a pixel is named that can
// be replayed to be dropped.
TEST(Render, NamesTheFirstDroppedSampleOfEveryChunking) {
  const int w = 10, h = 6, spp = 80;
  const double edge = 0.95;
  const Tensors t = wall(w, h, 0.5, 0);
  std::vector<RenderCounts> counts;
  std::vector<std::vector<double>> firsts;
  for (const int chunk_rays : {1 << 18, 16 * 7, 48, 16}) {
    Graph graph;
    Values v;
    for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
    const RenderSpec spec{.spp = spp, .trace = false, .chunk_rays = chunk_rays};
    const SurfaceMaps maps{v["depth"], {v["albedo"], v["normal"], v["material"]}};
    const Rendered rendered = render(graph, spec, maps, v["camera"], v["range"], {}, light_with_a_hole(edge));
    const std::vector<Tensor> got = evaluate(graph, {rendered.status, rendered.tally}, test_device(), t, {}, 3);
    counts.push_back(render_counts(got[0], got[1]));
    std::vector<double> first;
    for (int p = 0; p < w * h; ++p)
      first.push_back(render_counts(Tensor({1, 1, 1, 1}), tally_of_pixel(got[1], p))
                          .first_dropped.value_or(RenderCounts::Offender{0, -1})
                          .sample);
    firsts.push_back(first);
  }
  // The replay: all samples' directions, drawn without the layer.
  Graph graph;
  Values v;
  for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
  const Surfaces surfaces{v["albedo"], v["normal"], v["material"]};
  const BrdfSamples drawn = sample_brdf(v["depth"], v["camera"], surfaces, surfaces, w * h, spp);
  const Tensor direction = evaluate(graph, {drawn.direction}, test_device(), t, {}, 3)[0];
  int late = 0, often = 0, dropped = 0;
  std::optional<int> pixel;
  std::vector<double> want;
  for (int p = 0; p < w * h; ++p) {
    int first = -1;
    std::set<int> chunks;
    for (int s = 0; s < spp; ++s) {
      if (!(direction.at(0, 0, p, s) > static_cast<float>(edge))) continue;
      if (first < 0) first = s;
      chunks.insert(s / 16), ++dropped;
    }
    late += first >= 16, often += chunks.size() > 1;
    if (first >= 0 && !pixel) pixel = p;
    want.push_back(first);
  }
  EXPECT_GT(late, 2) << "no sample beyond the first chunk is the first";
  EXPECT_GT(often, 2) << "no pixel drops samples in two chunks";
  for (std::size_t k = 0; k < counts.size(); ++k) {
    EXPECT_EQ(firsts[k], want) << "chunking " << k;
    EXPECT_EQ(counts[k].dropped, dropped);
    ASSERT_TRUE(counts[k].first_dropped);
    EXPECT_EQ(counts[k].first_dropped->pixel, *pixel);
    EXPECT_EQ(counts[k].first_dropped->sample, want[static_cast<std::size_t>(*pixel)]);
  }
}

// A light on the host that does what image_light does gives the same bits.
TEST(Render, LightFromTheHostIsTheSameLayer) {
  const int w = 13, h = 9;
  Tensors t = wall(w, h, 0.4, 0.5);
  RenderSpec spec{.spp = 20, .chunk_rays = 32 * 50};
  const Picture graph = Layer(t, spec, "image").run(3);
  Device device = test_device();
  const auto fill = [&](const HostRays& rays) {
    const std::size_t plane =
        static_cast<std::size_t>(rays.pixel_capacity) * static_cast<std::size_t>(rays.sample_capacity);
    std::vector<int> hit(plane);
    device.read(rays.hit_pixel.buffer, hit.data(), plane * sizeof(int), rays.hit_pixel.offset * sizeof(int));
    std::vector<float> radiance(3 * plane, NAN);  // beyond the chunk nothing may be read
    for (int c = 0; c < 3; ++c)
      for (int p = 0; p < rays.chunk.pixels; ++p)
        for (int s = 0; s < rays.chunk.samples; ++s) {
          const std::size_t at = static_cast<std::size_t>(p * rays.sample_capacity + s);
          const double value =
              hit[at] < 0 ? t["ambient"].at(0, c, 0, 0) : t["image"].at(0, c, hit[at] / w, hit[at] % w);
          radiance[static_cast<std::size_t>(c) * plane + at] = static_cast<float>(value);
        }
    device.write(rays.radiance.buffer, radiance.data(), radiance.size() * sizeof(float),
                 rays.radiance.offset * sizeof(float));
    device.finish();
  };
  const HostRendered host = render_with_host_light(device, spec, t, 3, fill);
  EXPECT_EQ(host.radiance.real, graph.radiance.real);
  EXPECT_EQ(host.standard_error.real, graph.standard_error.real);
  EXPECT_EQ(host.uncertainty.real, graph.uncertainty.real);
  EXPECT_EQ(host.tally.real, graph.tally.real);
}

TEST(Render, GridAndLimits) {
  const Tensors t = wall(8, 6, 0.8, 0);
  RenderSpec spec{.spp = 128};
  spec.sampling.sampler = Sampler::Grid8x16;
  const Picture grid = Layer(t, spec, "constant").run(1);
  spec.sampling.sampler = Sampler::Cosine;
  const Picture cosine = Layer(t, spec, "constant").run(1);
  // A rough surface under constant light: the grid's quadrature is good to a few percent.
  for (std::size_t i = 0; i < grid.radiance.real.size(); ++i)
    ASSERT_NEAR(grid.radiance.real[i], cosine.radiance.real[i],
                0.03 * cosine.radiance.real[i] + 6 * cosine.standard_error.real[i]);
  spec.sampling.sampler = Sampler::Grid8x16, spec.spp = 64;
  EXPECT_THROW(Layer(t, spec, "constant"), Error);
  EXPECT_THROW(Layer(t, {.spp = 1}, "constant"), Error);
}

// A picture alone takes one sample: pictures of one by many seeds have the mean of a picture of as many.
TEST(Render, OneSampleIsEnoughWithoutStatistics) {
  constexpr int w = 8, h = 6, seeds = 256;
  const Tensors t = wall(w, h, 0.5, 0.5);
  const auto mean_of = [&](int spp, std::uint32_t seed) {
    Graph graph;
    Values v;
    for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
    RenderSpec spec{.spp = spp, .statistics = false};
    spec.sampling.points = Points::Independent;
    const Rendered r = render(graph, spec, {v["depth"], {v["albedo"], v["normal"], v["material"]}}, v["camera"],
                              v["range"], std::vector{v["ambient"]}, constant_answers);
    EXPECT_FALSE(r.standard_error || r.uncertainty);
    return mean(evaluate(graph, {r.radiance}, test_device(), t, {}, seed)[0].real);
  };
  std::vector<double> ones;
  for (int s = 0; s < seeds; ++s) ones.push_back(mean_of(1, static_cast<std::uint32_t>(s)));
  EXPECT_GT(standard_deviation(ones), 0);
  EXPECT_NEAR(mean(ones), mean_of(seeds, 1000), 4 * standard_deviation(ones) * std::sqrt(2.0 / seeds));
  EXPECT_THROW(mean_of(0, 0), Error);
}

// What the layer is sized for: 640 x 480 pixels, 64 samples, 19.7 million rays, within 1 GiB.
TEST(Render, AWholePictureFitsInAGibibyte) {
  Tensors t = wall(640, 480, 0.4, 0.1);
  const BenchRoom room = bench_room(640, 480);
  t["depth"] = room.depth, t["normal"] = room.normal, t["range"] = depth_range(room.depth);
  t["camera"] = camera_tensor(std::span(&room.camera, 1));
  Layer layer(t, {.spp = 64}, "image");
  Device device = layer.executor->plan().device;
  device.finish();
  device.reset_memory_peak();
  const Picture p = layer.run(1);
  EXPECT_LT(device.memory_peak(), std::size_t{1} << 30);
  EXPECT_GT(render_counts(p.status, p.tally).directions, 18e6);
}

}  // namespace
}  // namespace clerestory
