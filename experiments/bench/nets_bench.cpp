#include "experiments/bench/nets_bench.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>

#include "experiments/evaluation/prepare.hpp"
#include "host/ops/light/bench_room.hpp"
#include "host/process_memory.hpp"
#include "nets/densenet.hpp"
#include "nets/light_training.hpp"
#include "nets/mgnet_training.hpp"
#include "nets/resnet.hpp"

namespace clerestory {
namespace {

/// A graph with what is fed to it and what it is asked for.
struct Job {
  std::unique_ptr<Graph> graph = std::make_unique<Graph>();
  std::vector<Value> outputs = {};
  std::vector<std::pair<std::string, Tensor>> feeds = {};
  int items = 1;
  bool updates = false;

  void feed(const std::string& name, Tensor tensor) { feeds.emplace_back(name, std::move(tensor)); }
};

/// In [0, 1).
Tensor shares(const Shape& shape, std::uint32_t seed) {
  Tensor t = noise(shape, seed, 0.5);
  for (double& v : t.real) v += 0.5;
  return t;
}

/// Item after item the same.
Tensor repeated(const Tensor& one, int n) {
  Tensor t = one;
  t.shape.n = n;
  for (int i = 1; i < n; ++i) t.real.insert(t.real.end(), one.real.begin(), one.real.end());
  return t;
}

Job densenet_trunk(int batch) {
  Job job{.items = batch};
  const Value image = job.graph->input("image", {batch, 3, 240, 320});
  job.feed("image", shares(image.shape(), 1));
  job.outputs = {densenet({*job.graph, false, "encoder"}, image, {})[4]};
  return job;
}

Job resnet_trunk(int batch) {
  Job job{.items = batch};
  const Value image = job.graph->input("image", {batch, 3, 240, 320});
  job.feed("image", shares(image.shape(), 1));
  job.outputs = {resnet({*job.graph, false, "encoder"}, image, {}).back()};
  return job;
}

Job mgnet_forward(const std::string& preset, int batch, int width, int height) {
  Job job{.items = batch};
  const Value image = job.graph->input("image", {batch, 3, padded_size(height), padded_size(width)});
  job.feed("image", shares(image.shape(), 1));
  const Maps maps = mgnet(*job.graph, image, mgnet_size(preset), false);
  job.outputs = {maps.albedo, maps.normal, maps.material, maps.depth, maps.log_scale};
  return job;
}

void feed_adam(Job& job) {
  job.feed("learning_rate", Tensor({}, 1e-5));
  job.feed("step", Tensor({}, 1.0));
}

/// On views of width x height, padded as the trainer pads them.
Job mgnet_step(const std::string& preset, int batch, int width, int height) {
  Job job{.items = batch, .updates = true};
  MgnetTrainingOptions options;
  options.batch = batch, options.height = padded_size(height), options.width = padded_size(width);
  const MgnetTraining training = mgnet_training(*job.graph, mgnet_size(preset), options);
  for (const auto& [name, value] : training.losses) job.outputs.push_back(value);
  job.outputs.push_back(training.squares);
  const auto map = [&](int channels) { return Shape{batch, channels, options.height, options.width}; };
  std::uint32_t seed = 1;
  for (const char* name : {"image", "albedo"}) job.feed(name, shares(map(3), seed++));
  job.feed("material", shares(map(2), seed++)), job.feed("depth", shares(map(1), seed++));
  job.feed("normal", repeated(bench_room(options.width, options.height).normal, batch));
  for (const char* name : {"albedo_mask", "geometry_mask", "material_mask"}) job.feed(name, Tensor(map(1), 1));
  job.feed("log_scale", shares({batch, 1, 1, 1}, seed)), job.feed("scale_mask", Tensor(Shape{batch, 1, 1, 1}, 1));
  feed_adam(job);
  return job;
}

/// The light's nets, and the pixels that are rendered again, as experiments/configs/light_compact.toml has them.
LightSizes compact_light() {
  LightSizes sizes = light_sizes("compact");
  sizes.out_of_view.form = OutOfViewForm::Shells, sizes.out_of_view.sees_maps = true;
  return sizes;
}

LightTrainingOptions compact_light_step() {
  LightTrainingOptions options;
  options.batch = 8, options.shade_width = 16, options.shade_height = 12;
  options.weights.rerender = 1, options.radiance = RadianceLoss::Relative;
  return options;
}

/// Rays from pixels of the room all over the picture, to anywhere.
struct RoomRays {
  Tensor points, directions, skip;
};
RoomRays room_rays(const BenchRoom& room, int rows, int samples, std::uint32_t seed) {
  const Shape shape{1, 3, rows, samples};
  RoomRays rays{Tensor(shape), noise(shape, seed), {}};
  std::vector<int> skip;
  for (int row = 0; row < rows; ++row) {
    const int pixel = static_cast<int>((row * 7919L + seed) % (room.camera.width * room.camera.height));
    const int x = pixel % room.camera.width, y = pixel / room.camera.width;
    const Vec3 point = room.camera.unproject(x + 0.5, y + 0.5, room.depth.at(0, 0, y, x));
    for (int s = 0; s < samples; ++s) {
      for (int c = 0; c < 3; ++c) rays.points.at(0, c, row, s) = point[c];
      double* d = &rays.directions.real[static_cast<std::size_t>(row * samples + s)];
      const std::size_t plane = static_cast<std::size_t>(rows) * static_cast<std::size_t>(samples);
      const double length = std::sqrt(d[0] * d[0] + d[plane] * d[plane] + d[2 * plane] * d[2 * plane]) + 1e-6;
      for (std::size_t c = 0; c < 3; ++c) d[c * plane] /= length;
      skip.push_back(pixel);
    }
  }
  rays.skip = Tensor::of_int({1, 1, rows, samples}, std::move(skip));
  return rays;
}

void feed_light_maps(Job& job, const std::string& prefix, const BenchRoom& room, int batch) {
  const Shape three{batch, 3, room.camera.height, room.camera.width};
  job.feed(prefix + "image", shares(three, 1)), job.feed(prefix + "albedo", shares(three, 2));
  job.feed(prefix + "material", shares(three, 3)), job.feed(prefix + "normal", repeated(room.normal, batch));
  job.feed(prefix + "depth", repeated(room.depth, batch));
  job.feed(prefix + "camera", repeated(camera_tensor(std::span(&room.camera, 1)), batch));
}

Job light_step(const LightSizes& sizes, const LightTrainingOptions& o) {
  Job job{.items = o.batch, .updates = true};
  const LightTraining training = light_training(*job.graph, sizes, o);
  for (const auto& [name, value] : training.losses) job.outputs.push_back(value);
  job.outputs.push_back(training.squares);
  const BenchRoom room = bench_room(o.width, o.height), coarse = bench_room(o.shade_width, o.shade_height);
  feed_light_maps(job, "", room, o.batch), feed_light_maps(job, "shade_", coarse, o.batch);
  job.feed("range", repeated(depth_range(room.depth), o.batch));
  job.feed("shade_mask", Tensor(Shape{o.batch, 1, o.shade_height, o.shade_width}, 1));
  for (int b = 0; b < o.batch; ++b) {
    const std::string at = std::to_string(b);
    const Shape rays{1, 3, o.rows, o.samples};
    RoomRays drawn = room_rays(room, o.rows, o.samples, static_cast<std::uint32_t>(b) + 1);
    job.feed("points" + at, std::move(drawn.points)), job.feed("directions" + at, std::move(drawn.directions));
    job.feed("skip" + at, std::move(drawn.skip)), job.feed("light" + at, shares(rays, 9));
    job.feed("known" + at, Tensor(Shape{1, 1, o.rows, o.samples}, 1));
    const int pixels = o.shade_height * o.shade_width;
    job.feed("shade_skip" + at,
             Tensor::of_int({1, 1, pixels, o.shade_samples},
                            std::vector<int>(static_cast<std::size_t>(pixels * o.shade_samples), -1)));
  }
  feed_adam(job);
  return job;
}

/// LightNet's MLP as it trains: the radiance along rays, and the gradients of what it reads and of its weights.
Job light_mlp_both_ways(const InViewSize& size) {
  constexpr int rows = 64, samples = 64, height = 240, width = 320;
  Job job{.items = rows * samples};
  Graph& g = *job.graph;
  const int channels = size.again > 0 ? 2 * size.width : size.width;
  const Shape rays{1, 3, rows, samples};
  const LightPixels pixels{g.input("features", {1, channels, height / 2, width / 2}),
                           g.input("surface", {1, channels, height, width})};
  const Value hit = g.input("hit", {1, 1, rows, samples}, Type::Int), direction = g.input("direction", rays),
              photo = g.input("photo", {1, 3, height, width}), slope = g.input("slope", rays);
  const Value radiance = in_view_light({g, true, "local"}, pixels, hit, direction, photo, size);
  std::vector<Value> wanted = g.parameters();
  wanted.push_back(pixels.features), wanted.push_back(pixels.surface);
  job.outputs = gradient(std::vector{radiance}, std::vector{slope}, wanted);
  job.outputs.push_back(radiance);
  job.feed("features", noise(pixels.features.shape(), 1)), job.feed("surface", noise(pixels.surface.shape(), 2));
  job.feed("direction", noise(rays, 3)), job.feed("photo", shares(photo.shape(), 4)), job.feed("slope", noise(rays, 5));
  std::vector<int> pixel;
  for (int i = 0; i < rows * samples; ++i) pixel.push_back(static_cast<int>(i * 7919L % (height * width)));
  job.feed("hit", Tensor::of_int(hit.shape(), std::move(pixel)));
  return job;
}

struct Row {
  const char* name;
  Job (*make)();
};
constexpr Row kRows[]{
    {"DenseNet121 forward, 320x240, batch 1", [] { return densenet_trunk(1); }},
    {"DenseNet121 forward, 320x240, batch 4", [] { return densenet_trunk(4); }},
    {"ResNet34 forward, 320x240, batch 1", [] { return resnet_trunk(1); }},
    {"ResNet34 forward, 320x240, batch 4", [] { return resnet_trunk(4); }},
    {"MGNet paper forward, 320x240, batch 1", [] { return mgnet_forward("paper", 1, 320, 240); }},
    {"MGNet compact step, 160x120, batch 8", [] { return mgnet_step("compact", 8, 160, 120); }},
    {"MGNet shared step, 160x120, batch 8", [] { return mgnet_step("shared", 8, 160, 120); }},
    {"MGNet lite step, 160x120, batch 8", [] { return mgnet_step("lite", 8, 160, 120); }},
    {"MGNet paper step, 320x240, batch 2", [] { return mgnet_step("paper", 2, 320, 240); }},
    {"light compact step, 160x120, batch 8", [] { return light_step(compact_light(), compact_light_step()); }},
    {"LightNet's MLP, paper, both ways", [] { return light_mlp_both_ways(in_view_size("paper")); }},
};

/// Memory as it is predicted before the first run, and as it was, in bytes.
struct MemoryRecord {
  std::size_t device_predicted = 0, device = 0, process_predicted = 0, process = 0;

  std::string text() const {
    const auto mib = [](std::size_t bytes) { return static_cast<double>(bytes) / 0x1p20; };
    if (process_predicted == 0) return fmt::format("{:>12.1f}", mib(device));
    return fmt::format("{:>12.1f}{:>12.1f}{:>12.1f}", mib(device), mib(process_predicted), mib(process));
  }
  nlohmann::ordered_json json() const {
    return {{"device_predicted", device_predicted},
            {"device", device},
            {"process_predicted", process_predicted},
            {"process", process}};
  }
};

std::vector<Row> chosen_rows(const std::string& only) {
  std::vector<Row> rows;
  for (const Row& row : kRows)
    if (std::string(row.name).find(only) != std::string::npos) rows.push_back(row);
  if (!rows.empty()) return rows;
  std::string known;
  for (const Row& row : kRows) known += (known.empty() ? "\"" : ", \"") + std::string(row.name) + '"';
  throw usage_error("no net is named so", "--only", only, "a part of " + known);
}

}  // namespace

nlohmann::ordered_json bench_nets(Device& device, const BenchOptions& options) {
  nlohmann::ordered_json result{{"device", device.info().name}, {"rows", nlohmann::ordered_json::array()}};
  if (!options.quiet)
    fmt::print("Whole nets{:>65}\n{:<40}{:>12}{:>12}{:>12}{:>12}{:>12}\n", "MiB of the process", "row", "ms", "items/s",
               "MiB, device", "predicted", "most");
  for (const Row& row : chosen_rows(options.only)) {
    const Job job = row.make();
    const auto states = std::make_shared<States>(device);
    states->initialise(*job.graph, 1);
    PlanOptions plan_options;
    plan_options.budget = options.memory, plan_options.budget_name = "--memory";
    forget_peak(), device.reset_memory_peak();
    Executor executor(compile(*job.graph, job.outputs, device, plan_options, job.updates), states);
    MemoryRecord memory{.device_predicted = executor.plan().memory().total(),
                        .process_predicted = executor.predicted_process()};
    for (const auto& [name, tensor] : job.feeds) executor.feed(name, tensor);
    const std::vector<double> runs = seconds_of_runs(device, executor, options.runs);
    memory.device = device.memory_peak(), memory.process = process_memory().peak;
    if (!options.quiet)
      fmt::print("{:<40}{:>12.1f}{:>12.2f}{}\n", row.name, best_of(runs) * 1e3, job.items / best_of(runs),
                 memory.text());
    if (options.explain && !options.quiet) fmt::print("{}", executor.explain(true));
    std::fflush(stdout);
    result["rows"].push_back({{"name", row.name},
                              {"items", job.items},
                              {"seconds", best_of(runs)},
                              {"runs", runs},
                              {"bytes", memory.json()}});
  }
  return result;
}

}  // namespace clerestory
