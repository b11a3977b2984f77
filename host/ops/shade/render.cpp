#include "host/ops/shade/render.hpp"

#include <algorithm>

#include "host/graph/map_chunks.hpp"
#include "host/graph/plan.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/shade/light_guide.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

constexpr int kGridDirections = 128;
enum Tally { kUncertainty, kDirections, kDropped, kHits, kFirstDropped, kTallies };

ChunkDomain domain_of(const RenderSpec& spec, const Shape& picture) {
  if (const int least = spec.statistics ? 2 : 1; spec.spp < least)
    throw usage_error(fmt::format("a picture{} needs more samples", spec.statistics ? " with its standard error" : ""),
                      "spp", std::to_string(spec.spp), fmt::format("at least {}", least));
  if (spec.sampling.sampler == Sampler::Grid8x16 && spec.spp != kGridDirections)
    throw usage_error("the sampler grid8x16 has a fixed number of samples", "spp", std::to_string(spec.spp), "128");
  if (spec.chunk_rays < 16) throw Error(ErrorKind::Failed, "a chunk of less than sixteen rays", "render");
  ChunkDomain d{picture.n, picture.h, picture.w, spec.spp, 0, 0, spec.every_chunk};
  d.chunk_samples = std::min((spec.spp + 15) / 16 * 16, spec.chunk_rays / 16 * 16);
  const long pixels = picture.n * picture.plane();
  d.chunk_pixels = static_cast<int>(std::clamp<long>(spec.chunk_rays / d.chunk_samples, 1, pixels));
  return d;
}

int sample_chunks(const ChunkDomain& d) { return (d.samples + d.chunk_samples - 1) / d.chunk_samples; }

/// What rays are traced against, as values of one graph.
struct Traced {
  SsrtScene scene;
  Value range;
  RayOrigins origins;
};

SsrtScene traced_scene(const RenderSpec& spec, Value depth, Value normal) {
  return ssrt_scene(depth, spec.facing ? normal : Value{});
}

SsrtHits trace(const RenderSpec& spec, const Traced& t, Value camera, Value direction) {
  if (!spec.trace) return {};
  return ssrt(t.scene, camera, t.range, direction, t.origins, spec.ssrt);
}

}  // namespace

Rendered render(Graph& graph, const RenderSpec& spec, const SurfaceMaps& maps, Value camera, Value range,
                std::span<const Value> light_inputs, const LightBuilder& light, const Blockers& blockers,
                const Surfaces& sampling) {
  const ChunkDomain domain = domain_of(spec, maps.depth.shape());
  const Surfaces drawn_from = sampling.normal ? sampling : maps.surfaces;
  const bool detached = static_cast<bool>(sampling.normal), blocked = static_cast<bool>(blockers.depth);

  // Outer values in one list; the inner ones come in the same order.
  std::vector<Value> outer{maps.depth, camera, maps.surfaces.albedo, maps.surfaces.normal, maps.surfaces.material};
  const std::size_t sampling_at = outer.size();
  if (detached) outer.insert(outer.end(), {drawn_from.albedo, drawn_from.normal, drawn_from.material});
  const std::size_t traced_at = outer.size();
  std::size_t of_scene = 0;
  if (spec.trace) {
    const std::vector<Value> against =
        traced_scene(spec, blocked ? blockers.depth : maps.depth, blocked ? blockers.normal : maps.surfaces.normal)
            .values();
    of_scene = against.size();
    outer.push_back(range);
    outer.insert(outer.end(), against.begin(), against.end());
    if (blocked) outer.insert(outer.end(), {surface_points(maps.depth, camera), blockers.skip});
  } else {
    graph.left_out("screen-space rays: the light does not ask where they end");
  }
  const std::size_t lamps_at = outer.size();
  if (spec.lamps) outer.push_back(spec.lamps);
  const std::size_t light_at = outer.size();
  outer.insert(outer.end(), light_inputs.begin(), light_inputs.end());

  const auto counts = std::make_shared<RayCounts>();
  const auto body = [=](Graph& g, std::span<const Value> in) -> std::vector<ChunkOutput> {
    const Surfaces surfaces{in[2], in[3], in[4]};
    const Surfaces from = detached ? Surfaces{in[sampling_at], in[sampling_at + 1], in[sampling_at + 2]} : surfaces;
    const Value guide = spec.lamps ? light_guide(in[0], in[1], from, in[lamps_at], domain.chunk_pixels) : Value{};
    const BrdfSamples samples =
        sample_brdf(in[0], in[1], from, surfaces, domain.chunk_pixels, domain.chunk_samples, spec.sampling, guide);
    Traced traced;
    if (spec.trace) {
      const std::span<const Value> t = in.subspan(traced_at);
      traced = {ssrt_scene(t.subspan(1, of_scene)), t[0], {}};
      if (blocked) traced.origins = {t[1 + of_scene], t[2 + of_scene], true};
    }
    const RayBatch rays{samples.direction, samples.lobes, trace(spec, traced, in[1], samples.direction),
                        {in[0], surfaces}, in[1],         counts.get()};
    counts->clear();
    const Value radiance = light(g, rays, in.subspan(light_at));
    const SampleSums sums =
        accumulate_samples(samples.weight, radiance, samples.pdf, rays.hits.u, rays.hits.pixel, spec.spp);
    std::vector<ChunkOutput> outputs{
        {sums.mean}, {sums.squares}, {sums.tally}, {samples.status}, {.value = sums.first, .first = true}};
    for (const auto& [name, count] : *counts) outputs.push_back({.value = count, .total = true});
    return outputs;
  };
  const std::vector<Value> whole = map_chunks(graph, domain, outer, body);
  const SampleStatistics statistics =
      spec.statistics ? finish_samples(whole[1], whole[2], spec.spp, sample_chunks(domain)) : SampleStatistics{};
  const Value tally = concat(std::vector{whole[2], whole[4]});
  Rendered rendered{whole[0], statistics.standard_error, statistics.uncertainty, whole[3], tally, {}};
  for (std::size_t i = 5; i < whole.size(); ++i) rendered.counts.emplace_back((*counts)[i - 5].first, whole[i]);
  return rendered;
}

RenderCounts render_counts(const Tensor& status, const Tensor& tally) {
  RenderCounts counts;
  const long plane = status.shape.plane();
  for (int n = 0; n < status.shape.n; ++n)
    for (long p = 0; p < plane; ++p) {
      const double state = status.real[static_cast<std::size_t>(n * plane + p)];
      (state == 0 ? counts.shaded : state == 1 ? counts.without_depth : counts.facing_away) += 1;
      const auto of = [&](Tally t) { return tally.real[static_cast<std::size_t>((n * kTallies + t) * plane + p)]; };
      counts.directions += of(kDirections);
      counts.hits += of(kHits);
      counts.dropped += of(kDropped);
      if (of(kDropped) > 0 && !counts.first_dropped)
        counts.first_dropped = RenderCounts::Offender{n * plane + p, static_cast<int>(of(kFirstDropped)) - 1};
    }
  return counts;
}

namespace {

using Feeds = std::map<std::string, Tensor>;

const Tensor& fed(const Feeds& feeds, const char* name) {
  const auto found = feeds.find(name);
  if (found == feeds.end()) throw Error(ErrorKind::Failed, "a map is missing", fmt::format("render: {}", name));
  return found->second;
}

Value input(Graph& graph, const Feeds& feeds, const char* name) { return graph.input(name, fed(feeds, name).shape); }

/// Once: what is made of the whole picture.
struct WholePicture {
  Graph graph;
  Value depth, points;
  SsrtScene scene;
  Executor executor;

  WholePicture(const Device& device, const RenderSpec& spec, const Feeds& feeds)
      : depth(input(graph, feeds, "depth")),
        points(surface_points(depth, input(graph, feeds, "camera"))),
        scene(traced_scene(spec, depth, input(graph, feeds, "normal"))),
        executor(compile(graph, made(), device)) {
    for (const char* name : {"depth", "camera"}) executor.feed(name, fed(feeds, name));
    if (spec.facing) executor.feed("normal", fed(feeds, "normal"));
    executor.run();
  }

  std::vector<Value> made() const {
    std::vector<Value> values{points, scene.pyramid};
    if (scene.boxes) values.push_back(scene.boxes);
    return values;
  }
};

/// Before the callback: a chunk's directions, weights, hits.
struct DrawnRays {
  Graph graph;
  SurfaceMaps maps;
  Value camera;
  BrdfSamples samples;
  SsrtHits hits;
  Executor executor;

  DrawnRays(const Device& device, const RenderSpec& spec, const ChunkDomain& domain, const Feeds& feeds,
            const WholePicture& whole)
      : maps{input(graph, feeds, "depth"),
             {input(graph, feeds, "albedo"), input(graph, feeds, "normal"), input(graph, feeds, "material")}},
        camera(input(graph, feeds, "camera")),
        samples(sample_brdf(maps.depth, camera, maps.surfaces, maps.surfaces, domain.chunk_pixels, domain.chunk_samples,
                            spec.sampling)),
        hits(spec.trace ? trace(spec, traced(spec, feeds, whole), camera, samples.direction) : SsrtHits{}),
        executor(compile(graph, made(), device)) {
    for (const char* name : {"depth", "albedo", "normal", "material", "camera"}) executor.feed(name, fed(feeds, name));
    if (!spec.trace) return;
    executor.feed("range", fed(feeds, "range"));
    executor.bind("pyramid", whole.executor.view(whole.scene.pyramid));
    if (spec.facing) executor.bind("boxes", whole.executor.view(whole.scene.boxes));
  }

  Traced traced(const RenderSpec& spec, const Feeds& feeds, const WholePicture& whole) {
    Traced t{
        {maps.depth, graph.input("pyramid", whole.scene.pyramid.shape()), {}, {}}, input(graph, feeds, "range"), {}};
    if (spec.facing) {
      t.scene.normal = maps.surfaces.normal;
      t.scene.boxes = graph.input("boxes", whole.scene.boxes.shape(), Type::Int);
    }
    return t;
  }

  std::vector<Value> made() const {
    std::vector<Value> values{samples.direction, samples.weight, samples.pdf, samples.status};
    if (hits.u) values.insert(values.end(), {hits.u, hits.pixel});
    if (samples.lobes) values.insert(values.end(), {samples.lobes.specular, samples.lobes.density});
    return values;
  }

  TensorView view(Value value) const { return value ? executor.view(value) : TensorView{}; }
};

/// After it: sums.
struct SummedRays {
  Graph graph;
  SampleSums sums;
  Value tally;
  Executor executor;
  TensorView radiance;  // for the callback to fill

  SummedRays(Device& device, const RenderSpec& spec, const DrawnRays& drawn)
      : sums(summed(spec, drawn.samples.weight.shape(), drawn.samples.pdf.shape())),
        tally(concat(std::vector{sums.tally, sums.first})),
        executor(compile(graph, {sums.mean, sums.squares, tally}, device)) {
    const Shape rays = drawn.samples.weight.shape();
    radiance = {device.allocate(static_cast<std::size_t>(rays.count()) * sizeof(float)), 0,
                static_cast<int>(rays.item()), rays, Type::Real};
    executor.bind("radiance", radiance);
    executor.bind("weight", drawn.view(drawn.samples.weight));
    executor.bind("pdf", drawn.view(drawn.samples.pdf));
    if (!spec.trace) return;
    executor.bind("u", drawn.view(drawn.hits.u));
    executor.bind("hit", drawn.view(drawn.hits.pixel));
  }

  SampleSums summed(const RenderSpec& spec, const Shape& rays, const Shape& one) {
    const Value u = spec.trace ? graph.input("u", one) : Value{};
    const Value hit = spec.trace ? graph.input("hit", one, Type::Int) : Value{};
    return accumulate_samples(graph.input("weight", rays), graph.input("radiance", rays), graph.input("pdf", one), u,
                              hit, spec.spp);
  }
};

/// A chunk's columns, to where their pixels lie in a batch of pictures.
void place(const Tensor& columns, const Chunk& chunk, Tensor& to) {
  const long plane = to.shape.plane();
  for (int c = 0; c < columns.shape.c; ++c)
    for (int p = 0; p < chunk.pixels; ++p) {
      const long n = (chunk.first_pixel + p) / plane, at = (chunk.first_pixel + p) - n * plane;
      to.real[static_cast<std::size_t>((n * to.shape.c + c) * plane + at)] = columns.at(0, c, p, 0);
    }
}

void check_host_lit(const RenderSpec& spec, const ChunkDomain& domain) {
  if (spec.lamps) throw Error(ErrorKind::Failed, "lamps of another graph", "render_with_host_light");
  if (sample_chunks(domain) > 1)
    throw usage_error("more samples than one chunk holds", "spp", std::to_string(spec.spp),
                      fmt::format("at most {}", spec.chunk_rays));
}

}  // namespace

HostRendered render_with_host_light(Device device, const RenderSpec& spec, const Feeds& feeds, std::uint32_t seed,
                                    const std::function<void(const HostRays&)>& fill) {
  const Shape picture = fed(feeds, "depth").shape;
  const ChunkDomain domain = domain_of(spec, picture);
  check_host_lit(spec, domain);
  const WholePicture whole(device, spec, feeds);
  DrawnRays drawn(device, spec, domain, feeds, whole);
  SummedRays summed(device, spec, drawn);

  HostRendered result;
  const auto channels = [&](int c) { return Tensor(Shape{picture.n, c, picture.h, picture.w}); };
  result.radiance = channels(3), result.status = channels(1), result.tally = channels(kTallies);
  Tensor squares = channels(3);
  const int pixels = static_cast<int>(picture.n * picture.plane());
  for (int first = 0; first < pixels; first += domain.chunk_pixels) {
    const Chunk chunk{first, std::min(domain.chunk_pixels, pixels - first), 0, spec.spp};
    drawn.executor.run(seed, chunk);
    fill({chunk, domain.chunk_pixels, domain.chunk_samples, whole.executor.view(whole.points),
          drawn.view(drawn.samples.direction), drawn.view(drawn.samples.lobes.specular),
          drawn.view(drawn.samples.lobes.density), drawn.view(drawn.hits.pixel), summed.radiance});
    summed.executor.run(seed, chunk);
    place(summed.executor.fetch(summed.sums.mean), chunk, result.radiance);
    place(summed.executor.fetch(summed.sums.squares), chunk, squares);
    place(summed.executor.fetch(summed.tally), chunk, result.tally);
    place(drawn.executor.fetch(drawn.samples.status), chunk, result.status);
  }

  Graph last;
  const Value counted = slice(last.input("tally", result.tally.shape), 0, kFirstDropped);
  const SampleStatistics statistics = finish_samples(last.input("squares", squares.shape), counted, spec.spp, 1);
  const std::vector<Tensor> finished = evaluate(last, {statistics.standard_error, statistics.uncertainty}, device,
                                                {{"squares", squares}, {"tally", result.tally}});
  result.standard_error = finished[0], result.uncertainty = finished[1];
  return result;
}

}  // namespace clerestory
