#include "experiments/bench/layer_bench.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/io/safetensors.hpp"
#include "host/ops/light/bench_room.hpp"
#include "nets/learned_light.hpp"
#include "nets/timed_layer.hpp"

namespace clerestory {
namespace {

constexpr std::uint32_t kSeed = 1;

struct LayerRow {
  const char* light;  // given | learned
  int width, samples;
  LayerResult result;

  std::string name() const {
    return fmt::format("{}, {}, {}x{}, {} samples", light, result == LayerResult::Picture ? "picture" : "gradients",
                       width, width * 3 / 4, samples);
  }
};
constexpr LayerRow kWritten{"given", 160, 64, LayerResult::OneDraw};
constexpr LayerRow kRows[]{
    {"given", 320, 64, LayerResult::Picture},
    {"given", 320, 64, LayerResult::OneDraw},
    {"given", 640, 64, LayerResult::Picture},
    {"learned", 320, 64, LayerResult::Picture},
    {"learned", 160, 64, LayerResult::OneDraw},
    {"given", 160, 16, LayerResult::OneDraw},
    kWritten,
    {"given", 160, 256, LayerResult::OneDraw},
    {"given", 160, 1024, LayerResult::OneDraw},
};

/// Numbers like noise in [low, high], rounded to float.
Image noisy(int width, int height, int channels, std::uint32_t seed, float low, float high) {
  Image image(width, height, channels);
  const Tensor from = noise({1, channels, height, width}, seed, 0.5);
  for (std::size_t i = 0; i < image.data.size(); ++i)
    image.data[i] = low + (high - low) * static_cast<float>(from.real[i] + 0.5);
  return image;
}

/// The furnished room with materials and radiance of no order.
Scene bench_scene(int width) {
  const int height = width * 3 / 4;
  BenchRoom room = bench_room(width, height);
  for (double* number : {&room.camera.fx, &room.camera.fy, &room.camera.cx, &room.camera.cy})
    *number = static_cast<float>(*number);  // as a peer reads it
  Scene scene{room.camera, noisy(width, height, 3, 1, 0, 1),      noisy(width, height, 3, 2, 0.05f, 0.95f), {},
              {},          noisy(width, height, 3, 3, 0.1f, 0.9f)};
  scene.normal = Image(width, height, 3), scene.normal.data = room.normal.floats();
  scene.depth = Image(width, height, 1), scene.depth.data = room.depth.floats();
  std::fill_n(scene.material.plane(2), scene.material.pixels(), 0.0f);  // nothing emits
  return scene;
}

/// Nets that have learned nothing: what they cost is the same.
std::shared_ptr<const LightNets> untrained_nets(Device& device) {
  auto nets = std::make_shared<LightNets>();
  nets->sizes = light_sizes("compact"), nets->note = "random states";
  Graph graph;
  const Shape rays{1, 3, 1, 16};
  const LitPicture picture = lit_pictures(graph, light_inputs(graph, 1, 32, 32), nets->sizes, false)[0];
  ask_light(graph, picture, nets->sizes, graph.input("points", rays), graph.input("directions", rays),
            graph.input("skip", {1, 1, 1, 16}, Type::Int));
  nets->states = std::make_shared<States>(device);
  nets->states->initialise(graph, kSeed);
  return nets;
}

RenderSettings settings_of(const LayerRow& row, Device& device) {
  RenderSettings settings;
  settings.spp = row.samples, settings.points = "independent";
  if (std::string_view(row.light) == "given") return settings;
  settings.light = "net", settings.nets = untrained_nets(device);
  return settings;
}

/// What kernels took in one run, slowest first.
std::vector<KernelProfile> kernels_of(Device& device, TimedLayer& layer) {
  device.set_profiling(true), device.reset_profile();
  layer.run(kSeed);
  std::vector<KernelProfile> kernels = device.profile();
  device.set_profiling(false);
  return kernels;
}

double tracing_seconds(const std::vector<KernelProfile>& kernels) {
  double seconds = 0;
  for (const KernelProfile& kernel : kernels)
    if (kernel.kernel == "light/ssrt.cl:ssrt") seconds += kernel.seconds;
  return seconds;
}

void write_layer(Device& device, const std::filesystem::path& path, const LayerRow& row) {
  const Scene scene = bench_scene(row.width);
  const long h = scene.height(), w = scene.width();
  const std::array<double, 3> ambient = ambient_of(scene);
  TensorFile file;
  const auto add = [&](const std::string& name, const Image& map) {
    file.tensors[name] = {{map.channels, h, w}, map.data};
  };
  add("photo", scene.photo), add("albedo", scene.albedo), add("normal", scene.normal), add("depth", scene.depth);
  add("material", scene.material);
  const std::vector<float> camera = camera_tensor(std::span(&scene.camera, 1)).floats();
  file.tensors["camera"] = {{4}, camera};
  file.tensors["range"] = {{3}, depth_range(tensor_of(scene.depth)).floats()};
  file.tensors["ambient"] = {{3}, std::vector<float>(ambient.begin(), ambient.end())};
  file.metadata = {{"samples", std::to_string(row.samples)}, {"seed", std::to_string(kSeed)}};
  for (const auto& [prefix, precision] : {std::pair{"float ", Precision::Single}, {"double ", Precision::Double}}) {
    if (precision == Precision::Double && !device.has_double()) continue;
    for (const LayerResult result : {LayerResult::Picture, LayerResult::OneDraw}) {
      TimedLayer layer(device, scene, settings_of(row, device), result, precision);
      layer.run(kSeed);
      for (const auto& [name, values] : layer.values())
        file.tensors[prefix + name] = {{static_cast<long>(values.size()) / (h * w), h, w},
                                       std::vector<float>(values.begin(), values.end())};
    }
  }
  write_safetensors(path, file);
}

}  // namespace

nlohmann::ordered_json bench_layer(Device& device, const BenchOptions& options) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  if (!options.quiet)
    fmt::print("Monte Carlo layer: the furnished room, vndf_caps, independent points\n{:<44}{:>10}{:>9}{:>14}{:>9}\n",
               "row", "ms", "rays/us", "in tracing", "MiB");
  for (const LayerRow& row : kRows) {
    if (row.name().find(options.only) == std::string::npos) continue;
    const Scene scene = bench_scene(row.width);
    TimedLayer layer(device, scene, settings_of(row, device), row.result);
    const std::vector<double> runs = seconds_of_runs(options.runs, [&] { return layer.run(kSeed); });
    const double seconds = best_of(runs), rays = static_cast<double>(scene.photo.pixels()) * row.samples;
    const std::vector<KernelProfile> kernels = kernels_of(device, layer);
    const double tracing = tracing_seconds(kernels);
    const double traced = rays * layer.traces();
    const std::size_t memory = layer.memory();
    if (!options.quiet)
      fmt::print("{:<44}{:>10.1f}{:>9.2f}{:>14.2f}{:>9.0f}\n", row.name(), seconds * 1e3, rays / seconds * 1e-6,
                 traced / tracing * 1e-6, static_cast<double>(memory) / (1 << 20));
    if (!options.quiet && options.explain)
      for (const KernelProfile& kernel : kernels)
        fmt::print("    {:<52}{:>6} launches{:>10.1f} ms\n", kernel.kernel, kernel.launches, kernel.seconds * 1e3);
    std::fflush(stdout);
    rows.push_back({{"name", row.name()},
                    {"light", row.light},
                    {"width", row.width},
                    {"height", row.width * 3 / 4},
                    {"samples", row.samples},
                    {"gradients", row.result != LayerResult::Picture},
                    {"seconds", seconds},
                    {"runs", runs},
                    {"rays_traced", traced},
                    {"tracing_seconds", tracing},
                    {"memory_bytes", memory}});
  }
  if (rows.empty())
    throw usage_error("no row is named so", "--only", options.only,
                      "a part of given|learned, picture|gradients, WIDTHxHEIGHT, SAMPLES samples");
  if (!options.write.empty()) write_layer(device, options.write / "layer.safetensors", kWritten);
  return {{"device", device.info().name}, {"rows", std::move(rows)}};
}

}  // namespace clerestory
