#include "experiments/bench/ssrt_bench.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "experiments/bench/ray_scenes.hpp"
#include "host/cl/seconds_of.hpp"
#include "host/io/safetensors.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/shade/sample_brdf.hpp"

namespace clerestory {
namespace {

constexpr int kSamples = 16, kBands = 16;
constexpr std::array kWidths{320, 640, 1280};
constexpr int kBandPixels = 320 * 240 / kBands;  // the smallest picture is traced whole

/// Pixels that lie side by side in memory, and a direction {1, 3, pixels, samples} for each of their rays.
struct Band {
  Chunk chunk;
  Tensor directions;
};

std::vector<Band> cosine_rays(Device& device, const RayScene& scene) {
  const Shape& picture = scene.depth.shape;
  Graph g;
  const Value depth = g.input("depth", picture), camera = g.input("camera", {1, 4, 1, 1}),
              normal = g.input("normal", scene.normal.shape), material = g.input("material", scene.normal.shape);
  const Surfaces surfaces{material, normal, material};  // of which the cosine lobe sees the normal alone
  const Value drawn = sample_brdf(depth, camera, surfaces, surfaces, kBandPixels, kSamples,
                                  {.sampler = Sampler::Cosine, .points = Points::Independent})
                          .direction;
  Executor draw(compile(g, {drawn}, device));
  draw.feed("depth", scene.depth), draw.feed("normal", scene.normal);
  draw.feed("camera", camera_tensor(std::span(&scene.camera, 1)));
  draw.feed("material", Tensor(scene.normal.shape, 0.5));
  std::vector<Band> bands;
  for (int k = 0; k < kBands; ++k) {
    const Chunk chunk{k * (picture.w * picture.h / kBands), kBandPixels, 0, kSamples};
    draw.run(1, chunk);
    bands.push_back({chunk, draw.fetch(drawn)});
  }
  return bands;
}

bool is_ray(const Tensor& directions, int p, int s) {
  const auto component = [&](int c) { return directions.at(0, c, p, s); };
  return component(0) != 0 || component(1) != 0 || component(2) != 0;
}

long count_rays(const std::vector<Band>& bands) {
  long rays = 0;
  for (const Band& band : bands)
    for (int p = 0; p < kBandPixels; ++p)
      for (int s = 0; s < kSamples; ++s) rays += is_ray(band.directions, p, s);
  return rays;
}

/// The rays of one scene traced in one way. What rays are traced against is made once.
class TracedBands {
 public:
  TracedBands(Device& device, const RayScene& scene, const std::vector<Band>& bands, bool facing, int lanes)
      : device_(device), prepared_(prepare(device, scene, facing)) {
    std::vector<Value> against;
    for (std::size_t i = 0; i < made_.size(); ++i)
      against.push_back(trace_.input(name_of(i), made_[i].shape(), made_[i].type()));
    hits_ = ssrt(ssrt_scene(against), trace_.input("camera", {1, 4, 1, 1}), trace_.input("range", {1, 3, 1, 1}),
                 trace_.input("directions", {1, 3, kBandPixels, kSamples}), {}, {.lanes = lanes});
    const Plan plan = compile(trace_, {hits_.pixel, hits_.delta, hits_.u}, device);
    for (const Band& band : bands) {
      Executor& executor = bands_.emplace_back(band.chunk, Executor(plan)).second;
      for (std::size_t i = 0; i < made_.size(); ++i) executor.bind(name_of(i), prepared_->view(made_[i]));
      executor.feed("camera", camera_tensor(std::span(&scene.camera, 1)));
      executor.feed("range", depth_range(scene.depth));
      executor.feed("directions", band.directions);
    }
  }

  double run() {
    return seconds_of(device_, [&] {
      for (auto& [chunk, executor] : bands_) executor.run(0, chunk);
    });
  }

  /// Of the last run.
  long hits() {
    long count = 0;
    for (auto& [chunk, executor] : bands_) {
      const Tensor pixels = executor.fetch(hits_.pixel);
      count += std::ranges::count_if(pixels.integer, [](int pixel) { return pixel >= 0; });
    }
    return count;
  }

 private:
  static std::string name_of(std::size_t i) { return fmt::format("scene {}", i); }

  std::unique_ptr<Executor> prepare(Device& device, const RayScene& scene, bool facing) {
    const Value depth = maps_.input("depth", scene.depth.shape);
    made_ = ssrt_scene(depth, facing ? maps_.input("normal", scene.normal.shape) : Value{}).values();
    auto prepared = std::make_unique<Executor>(compile(maps_, made_, device));
    prepared->feed("depth", scene.depth);
    if (facing) prepared->feed("normal", scene.normal);
    prepared->run();
    return prepared;
  }

  Device& device_;
  Graph maps_, trace_;
  std::vector<Value> made_;  // SsrtScene::values()
  std::unique_ptr<Executor> prepared_;
  SsrtHits hits_;
  std::vector<std::pair<Chunk, Executor>> bands_;
};

void write_rays(const std::filesystem::path& path, const RayScene& scene, const std::vector<Band>& bands) {
  const long h = scene.camera.height, w = scene.camera.width;
  std::vector<std::int32_t> pixels;
  std::vector<float> directions;
  for (const Band& band : bands)
    for (int p = 0; p < kBandPixels; ++p)
      for (int s = 0; s < kSamples; ++s) {
        if (!is_ray(band.directions, p, s)) continue;
        pixels.push_back(band.chunk.first_pixel + p);
        for (int c = 0; c < 3; ++c) directions.push_back(static_cast<float>(band.directions.at(0, c, p, s)));
      }
  const long rays = static_cast<long>(pixels.size());
  TensorFile file;
  file.tensors["depth"] = {{h, w}, scene.depth.floats()};
  file.tensors["normal"] = {{3, h, w}, scene.normal.floats()};
  file.tensors["camera"] = {{4}, camera_tensor(std::span(&scene.camera, 1)).floats()};
  file.tensors["pixel"] = {{rays}, std::move(pixels)};
  file.tensors["direction"] = {{rays, 3}, std::move(directions)};
  write_safetensors(path, file);
}

/// Times of a ray in the smallest picture and in others, by what else a row is.
class Growth {
 public:
  /// Of a ray over that at half the width; nothing for the first.
  std::optional<double> of(const std::string& what, double seconds) {
    const auto [found, first] = last_.try_emplace(what, seconds);
    if (first) return {};
    const double before = std::exchange(found->second, seconds);
    return seconds / before;
  }

 private:
  std::map<std::string, double> last_;
};

}  // namespace

nlohmann::ordered_json bench_ssrt(Device& device, const BenchOptions& options) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  if (!options.quiet)
    fmt::print("Screen-space rays: cosine rays of every surface, million a second\n{:<28}{:>6}{:>9}{:>10}{:>7}\n",
               "scene", "lanes", "rays/us", "doubling", "hits");
  Growth growth;
  for (const char* name : {"room", "office", "noise"})
    for (const int width : kWidths) {
      const int height = width * 3 / 4;
      const std::string sized = fmt::format("{}, {}x{}", name, width, height);
      const std::map<bool, std::string> ways{{false, sized}, {true, sized + ", facing"}};
      if (ways.at(true).find(options.only) == std::string::npos) continue;
      const RayScene scene = ray_scene(name, width, height);
      const std::vector<Band> bands = cosine_rays(device, scene);
      if (!options.write.empty())
        write_rays(options.write / fmt::format("{}_{}x{}.safetensors", name, width, height), scene, bands);
      const double rays = static_cast<double>(count_rays(bands));
      for (const auto& [facing, row] : ways)
        for (const int asked : options.lanes) {
          if (row.find(options.only) == std::string::npos) continue;
          const int lanes = asked > 0 ? asked : ssrt_lanes(device);
          TracedBands traced(device, scene, bands, facing, lanes);
          const std::vector<double> runs = seconds_of_runs(options.runs, [&] { return traced.run(); });
          const double seconds = best_of(runs), hit_rate = static_cast<double>(traced.hits()) / rays;
          const auto grown = growth.of(fmt::format("{} {} {}", name, facing, lanes), seconds / rays);
          if (!options.quiet)
            fmt::print("{:<28}{:>6}{:>9.2f}{:>10}{:>6.1f}%\n", row, lanes, rays / seconds * 1e-6,
                       grown ? fmt::format("{:.2f}", *grown) : "-", 100 * hit_rate);
          std::fflush(stdout);
          rows.push_back({{"name", row},
                          {"scene", name},
                          {"width", width},
                          {"height", height},
                          {"facing", facing},
                          {"lanes", lanes},
                          {"rays", rays},
                          {"hit_rate", hit_rate},
                          {"seconds", seconds},
                          {"runs", runs}});
        }
    }
  if (rows.empty())
    throw usage_error("no row is named so", "--only", options.only, "a part of SCENE, WIDTHxHEIGHT[, facing]");
  return {{"device", device.info().name}, {"float_width", device.info().float_width}, {"rows", std::move(rows)}};
}

}  // namespace clerestory
