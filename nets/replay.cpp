#include "nets/replay.hpp"

#include "host/graph/plan.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/shade/light_guide.hpp"
#include "host/ops/shade/replay_sample.hpp"
#include "nets/known_lamps.hpp"
#include "nets/scene_light.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

constexpr int kRow = 16;  // samples come in such rows, of which one is looked at

constexpr auto kGuideRow = "guide";  // the one output that is of the pixel, not of its rays

std::string input_name(std::size_t i) { return fmt::format("value {}", i); }

/// The whole picture's values, computed once, and what one row of samples makes of them.
class Replay {
 public:
  Replay(Device& device, const Scene& scene, const RenderSettings& settings, Precision precision)
      : scene_(scene), settings_(settings) {
    settings_.precision = precision;
    const PlanOptions options{.precision = precision};
    const SceneValues v = scene_values(whole_, scene);
    const double rays = static_cast<double>(scene.photo.pixels()) * settings.spp;
    RenderSettings without = settings_;
    without.lamps.clear();
    const SceneLight bare = scene_light(whole_, v, scene, without, rays);
    const SceneLight light = with_lamps(whole_, bare, settings_.lamps);
    spec_ = render_spec(settings_, light);

    const auto& [albedo, normal, material] = v.maps.surfaces;
    std::vector<Value> shared = light.inputs;
    const std::size_t lit = shared.size();
    shared.insert(shared.end(),
                  {v.maps.depth, v.camera, albedo, normal, material, v.range, surface_points(v.maps.depth, v.camera)});
    const std::vector<Value> against = ssrt_scene(v.maps.depth, normal).values();
    shared.insert(shared.end(), against.begin(), against.end());
    const std::size_t guided = shared.size();
    if (settings.sampler == kGuidedSampler)
      if (const std::optional<Tensor> lamps = known_lamps(scene, settings)) shared.push_back(whole_.constant(*lamps));
    prepared_.emplace(compile(whole_, shared, device, options), light.states);
    feed_scene(*prepared_, scene);
    light.feed(*prepared_);
    prepared_->run(settings.seed);

    std::vector<Value> in;
    for (std::size_t i = 0; i < shared.size(); ++i)
      in.push_back(row_.input(input_name(i), shared[i].shape(), shared[i].type()));
    const std::span<const Value> maps = std::span(in).subspan(lit), inputs = std::span(in).first(lit);
    const Surfaces surfaces{maps[2], maps[3], maps[4]};
    const Value guide = guided < in.size() ? light_guide(maps[0], maps[1], surfaces, in[guided], 1) : Value{};
    if (guided < in.size()) add(kGuideRow, guide);
    const BrdfSamples drawn = sample_brdf(maps[0], maps[1], surfaces, surfaces, 1, kRow, spec_.sampling, guide);
    add("made", replay_sample(maps[1], surfaces, drawn.direction, spec_.sampling));
    add("direction", drawn.direction), add("pdf", drawn.pdf), add("weight", drawn.weight);
    SsrtHits hits;
    if (spec_.trace) {
      hits = ssrt(ssrt_scene(maps.subspan(7, against.size())), maps[1], maps[5], drawn.direction, {}, spec_.ssrt);
      add("hit", hits.pixel), add("delta", hits.delta), add("u", hits.u);
    }
    const Value points = points_of_chunk(maps[6], drawn.direction);
    const auto ask = [&](const SceneLight& who, const SsrtHits& where) {
      return who.radiance({points, drawn.direction, drawn.lobes, where, maps[1]}, inputs.first(who.inputs.size()),
                          nullptr);
    };
    const auto at_u = [&](double u) { return SsrtHits{hits.pixel, hits.delta, row_.fill({1, 1, 1, kRow}, u)}; };
    add("radiance", ask(light, hits));
    if (bare.traces) add("in view", ask(bare, at_u(0))), add("out of view", ask(bare, at_u(1)));
    if (light.lamps) add("with lamps", ask(light, at_u(1))), add("without lamps", ask(bare, at_u(1)));
    std::vector<Value> outputs;
    for (const auto& [name, value] : named_) outputs.push_back(value);
    executor_.emplace(compile(row_, outputs, device, options), light.states);
    for (std::size_t i = 0; i < shared.size(); ++i) executor_->bind(input_name(i), prepared_->view(shared[i]));
  }

  std::vector<Quantity> of(int pixel, int sample) {
    const int first = sample / kRow * kRow;
    executor_->run(settings_.seed, {pixel, 1, first, std::min(kRow, spec_.spp - first)});
    const auto fetched = [&](const std::string& name) { return fetch(name, sample - first); };
    const auto part = [](const std::vector<double>& all, std::ptrdiff_t at, std::ptrdiff_t count) {
      return std::vector<double>(all.begin() + at, all.begin() + at + count);
    };
    const auto of_map = [&](const Image& map, int channels) {
      std::vector<double> values;
      for (int c = 0; c < channels; ++c) values.push_back(map.plane(c)[pixel]);
      return values;
    };
    const std::vector<double> made = fetched("made"), weight = fetched("weight"), radiance = fetched("radiance");
    const std::vector<double> guide = guide_row();
    std::vector<Quantity> all{{"depth", of_map(scene_.depth, 1)},
                              {"albedo", of_map(scene_.albedo, 3)},
                              {"roughness, metallic", of_map(scene_.material, 2)},
                              {"random numbers", part(made, 0, 4)},
                              {"frame, tangent", part(made, 4, 3)},
                              {"frame, bitangent", part(made, 7, 3)},
                              {"frame, normal", part(made, 10, 3)},
                              {"view, local", part(made, 13, 3)},
                              {"wi, local", part(made, 16, 3)},
                              {"wi, camera", fetched("direction")},
                              {"alpha", part(made, 19, 1)},
                              {"probability of the lobe", part(made, 20, 1)},
                              {"probability of lamps", part(guide, 0, std::min<std::ptrdiff_t>(1, std::ssize(guide)))},
                              {"drawn towards lamp", lamp_drawn(guide, made[2])},
                              {"pdf", fetched("pdf")},
                              {"weight", weight},
                              {"hit pixel", hit_pixel(fetched("hit"))},
                              {"delta", fetched("delta")},
                              {"u", fetched("u")},
                              {"radiance in view", fetched("in view")},
                              {"radiance out of view", fetched("out of view")},
                              {"radiance of lamps", of_lamps()},
                              {"radiance", radiance},
                              {"contribution", weight}};
    for (std::size_t c = 0; c < weight.size(); ++c) all.back().values[c] *= radiance[c] / spec_.spp;
    return all;
  }

 private:
  void add(const std::string& name, Value value) { named_.emplace_back(name, value); }

  /// The pixel's row of kernels/lib/guide.clh; nothing where no lamps are known.
  std::vector<double> guide_row() {
    for (const auto& [name, value] : named_)
      if (name == kGuideRow) {
        const std::vector<double> row = executor_->fetch(value).real;
        return row[1] > 0 ? row : std::vector<double>{};
      }
    return {};
  }

  /// Axis and sharpness of the lobe that drew the direction; nothing where the surface drew it. As guided_direction().
  static std::vector<double> lamp_drawn(const std::vector<double>& guide, double u) {
    if (guide.empty() || u >= guide[0]) return {};
    std::ptrdiff_t lobe = kGuideHead;
    for (int i = 1; i < static_cast<int>(guide[1]) && u >= guide[static_cast<std::size_t>(lobe) + 4]; ++i)
      lobe += kGuideLobe;
    return {guide.begin() + lobe, guide.begin() + lobe + 4};
  }

  /// The channels of one ray; nothing where nobody asked for it.
  std::vector<double> fetch(const std::string& name, int ray) {
    at_ = ray;
    for (const auto& [known, value] : named_) {
      if (known != name) continue;
      const Tensor all = executor_->fetch(value);
      std::vector<double> values;
      for (int c = 0; c < all.shape.c; ++c) {
        const auto i = static_cast<std::size_t>(c * kRow + ray);
        values.push_back(all.type() == Type::Int ? all.integer[i] : all.real[i]);
      }
      return values;
    }
    return {};
  }

  std::vector<double> hit_pixel(const std::vector<double>& hit) const {
    if (hit.empty() || hit[0] < 0) return {};
    const int at = static_cast<int>(hit[0]);
    return {static_cast<double>(at % scene_.width()), static_cast<double>(at / scene_.width())};
  }

  std::vector<double> of_lamps() {
    std::vector<double> with = fetch("with lamps", at_);
    const std::vector<double> without = fetch("without lamps", at_);
    for (std::size_t c = 0; c < with.size(); ++c) with[c] -= without[c];
    return with;
  }

  const Scene& scene_;
  RenderSettings settings_;
  RenderSpec spec_;
  Graph whole_, row_;
  std::optional<Executor> prepared_, executor_;
  std::vector<std::pair<std::string, Value>> named_;
  int at_ = 0;
};

}  // namespace

std::vector<Quantity> replay(Device& device, const Scene& scene, const RenderSettings& settings, int pixel, int sample,
                             Precision precision) {
  const int spp = render_spec(settings).spp;
  if (pixel < 0 || static_cast<std::size_t>(pixel) >= scene.photo.pixels())
    throw usage_error("there is no such pixel", "replay", std::to_string(pixel),
                      fmt::format("0 to {}", scene.photo.pixels() - 1));
  if (sample < 0 || sample >= spp)
    throw usage_error("there is no such sample", "replay", std::to_string(sample), fmt::format("0 to {}", spp - 1));
  return Replay(device, scene, settings, precision).of(pixel, sample);
}

}  // namespace clerestory
