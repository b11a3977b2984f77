#include "nets/scene_radiance.hpp"

#include <algorithm>

#include "host/error.hpp"
#include "nets/scene_light.hpp"

namespace clerestory {
namespace {

constexpr int kSamples = 16;  // rays of a row: any number of rays is a number of rows

std::string input_name(std::size_t i) { return fmt::format("light value {}", i); }

}  // namespace

struct SceneRadiance::State {
  Graph whole, block;
  std::unique_ptr<Executor> prepared, ask;
  int rows = 0;
  bool reads_hits = false, given = false, lamps = false;
  Value radiance;
  SsrtHits hits;
  RayCounts counts;
  ChunkListener after_block;

  int capacity() const { return rows * kSamples; }
};

SceneRadiance::SceneRadiance(Device device, const Scene& scene, const RenderSettings& settings, std::size_t most,
                             RayHits who)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  const SceneValues v = scene_values(s.whole, scene);
  const SceneLight light = scene_light(s.whole, v, scene, settings);
  const RenderSpec spec = render_spec(settings, light);
  s.after_block = settings.after_chunk;
  s.lamps = light.lamps, s.reads_hits = light.traces, s.given = light.traces && who == RayHits::Given;
  const bool traces = s.reads_hits && !s.given;
  s.rows = static_cast<int>(std::clamp<std::size_t>((most + kSamples - 1) / kSamples, 1,
                                                    static_cast<std::size_t>(std::max(spec.chunk_rays / kSamples, 1))));

  // Once: what the light makes of the scene, and what rays are traced against.
  std::vector<Value> shared = light.inputs;
  const std::size_t own = shared.size();
  shared.push_back(v.camera);
  if (traces) {
    const std::vector<Value> against = ssrt_scene(v.maps.depth, v.maps.surfaces.normal).values();
    shared.push_back(v.range);
    shared.insert(shared.end(), against.begin(), against.end());
  }
  s.prepared = std::make_unique<Executor>(compile(s.whole, shared, device), light.states);
  feed_scene(*s.prepared, scene);
  light.feed(*s.prepared);
  s.prepared->run(settings.seed);

  // For every block of rays.
  std::vector<Value> in;
  for (std::size_t i = 0; i < shared.size(); ++i)
    in.push_back(s.block.input(input_name(i), shared[i].shape(), shared[i].type()));
  const Shape rays{1, 3, s.rows, kSamples};
  AskedRays asked;
  asked.points = s.block.input("points", rays), asked.direction = s.block.input("directions", rays);
  asked.camera = in[own];
  if (s.lamps) asked.lobes = {s.block.input("specular", rays), s.block.input("lobe", {1, 1, s.rows, kSamples})};
  const Value skip = s.block.input("skip", {1, 1, s.rows, kSamples}, Type::Int);
  if (traces)
    s.hits = asked.hits = ssrt(ssrt_scene(std::span<const Value>(in).subspan(own + 2, 4)), asked.camera, in[own + 1],
                               asked.direction, {asked.points, skip}, spec.ssrt);
  if (s.given) {
    s.hits.pixel = s.block.input("hits", {1, 1, s.rows, kSamples}, Type::Int);
    s.hits.u = s.block.input("uncertainty", {1, 1, s.rows, kSamples});
    asked.hits = s.hits;
  }
  s.radiance = light.radiance(asked, std::span(in).first(own), &s.counts);
  std::vector<Value> outputs{s.radiance};
  if (traces) outputs.insert(outputs.end(), {s.hits.u, s.hits.pixel});
  for (const auto& [name, count] : s.counts) outputs.push_back(count);
  s.ask = std::make_unique<Executor>(compile(s.block, outputs, device), light.states);
  for (std::size_t i = 0; i < shared.size(); ++i) s.ask->bind(input_name(i), s.prepared->view(shared[i]));
}

SceneRadiance::~SceneRadiance() = default;

RadianceAnswers SceneRadiance::radiance(const Rays& rays) {
  const std::size_t count = rays.points.size();
  State& s = *state_;
  const bool lobes = !rays.lobes.density.empty();
  if (rays.directions.size() != count || (!rays.skip.empty() && rays.skip.size() != count) ||
      (lobes && (rays.lobes.density.size() != count || rays.lobes.specular.size() != 3 * count)) ||
      (s.given && rays.hits.size() != count))
    throw Error(ErrorKind::Failed, "lists of rays of unlike lengths", "radiance");
  const std::size_t block = static_cast<std::size_t>(s.capacity());
  RadianceAnswers answers;
  answers.radiance.resize(3 * count), answers.uncertainty.assign(count, 0), answers.pixel.assign(count, -1);
  for (const auto& [name, value] : s.counts) answers.answered.emplace_back(name, 0);

  const auto blocks = static_cast<int>((count + block - 1) / block);
  for (std::size_t first = 0; first < count; first += block) {
    if (s.after_block && first > 0) s.after_block(static_cast<int>(first / block), blocks);
    const std::size_t used = std::min(block, count - first);
    const Shape shape{1, 3, s.rows, kSamples};
    Tensor points(shape), directions(shape);  // a ray of no direction is none
    std::vector<int> skip(block, -1), hits(block, -1);
    Tensor uncertainty({1, 1, s.rows, kSamples}), specular(shape), lobe({1, 1, s.rows, kSamples});
    for (std::size_t i = 0; i < used; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        points.real[c * block + i] = rays.points[first + i][static_cast<int>(c)];
        directions.real[c * block + i] = rays.directions[first + i][static_cast<int>(c)];
        if (lobes) specular.real[c * block + i] = rays.lobes.specular[c * count + first + i];
      }
      if (!rays.skip.empty()) skip[i] = rays.skip[first + i];
      if (lobes) lobe.real[i] = rays.lobes.density[first + i];
      if (!s.given) continue;
      hits[i] = rays.hits[first + i];
      uncertainty.real[i] = hits[i] < 0 ? 1 : 0;
      answers.pixel[first + i] = hits[i], answers.uncertainty[first + i] = hits[i] < 0 ? 1 : 0;
    }
    s.ask->feed("points", points), s.ask->feed("directions", directions);
    if (s.lamps) s.ask->feed("specular", specular), s.ask->feed("lobe", lobe);
    s.ask->feed("skip", Tensor::of_int({1, 1, s.rows, kSamples}, std::move(skip)));
    if (s.given) {
      s.ask->feed("hits", Tensor::of_int({1, 1, s.rows, kSamples}, std::move(hits)));
      s.ask->feed("uncertainty", uncertainty);
    }
    s.ask->run();
    const std::vector<float> radiance = s.ask->fetch_floats(s.radiance);
    for (std::size_t c = 0; c < 3; ++c)
      std::copy_n(radiance.begin() + static_cast<std::ptrdiff_t>(c * block), used,
                  answers.radiance.begin() + static_cast<std::ptrdiff_t>(c * count + first));
    for (std::size_t i = 0; i < s.counts.size(); ++i)
      answers.answered[i].second += static_cast<std::uint32_t>(s.ask->fetch(s.counts[i].second).integer.at(0));
    if (!s.reads_hits || s.given) continue;
    const std::vector<float> u = s.ask->fetch_floats(s.hits.u);
    const Tensor pixel = s.ask->fetch(s.hits.pixel);
    std::copy_n(u.begin(), used, answers.uncertainty.begin() + static_cast<std::ptrdiff_t>(first));
    std::copy_n(pixel.integer.begin(), used, answers.pixel.begin() + static_cast<std::ptrdiff_t>(first));
  }
  if (s.after_block && blocks > 0) s.after_block(blocks, blocks);
  return answers;
}

}  // namespace clerestory
