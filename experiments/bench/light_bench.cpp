#include "experiments/bench/light_bench.hpp"

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/cl/ceilings.hpp"
#include "host/ops/light/ask_field.hpp"
#include "host/ops/light/ask_mlp.hpp"
#include "host/ops/light/ask_shells.hpp"
#include "host/ops/light/pixel_rows.hpp"
#include "nets/in_view.hpp"
#include "nets/out_of_view.hpp"

namespace clerestory {
namespace {

constexpr int kHeight = 240, kWidth = 320, kSamples = 64;

std::uint32_t next(std::uint32_t& seed) {
  seed = seed * 1664525u + 1013904223u;
  return seed >> 8;
}

/// Hits anywhere in the picture: what lies side by side in a list of rays lies apart in memory.
Tensor hits(const Shape& shape) {
  std::uint32_t seed = 3;
  std::vector<int> pixels(static_cast<std::size_t>(shape.count()));
  for (int& pixel : pixels) pixel = static_cast<int>(next(seed) % (kHeight * kWidth));
  return Tensor::of_int(shape, pixels);
}

/// A net asked in both ways in one graph of inputs.
struct Net {
  int rays = 0;
  double flops = 0;  // of a ray
  std::unique_ptr<Graph> graph = std::make_unique<Graph>();
  std::vector<std::pair<std::string, Tensor>> feeds = {};
  Value fused = {}, composed = {};
  Value before = {};  // computed once per picture: not timed

  Value input(const std::string& input_name, Tensor tensor) {
    const Value v = graph->input(input_name, tensor.shape, tensor.type());
    feeds.emplace_back(input_name, std::move(tensor));
    return v;
  }
};

Net in_view(const InViewSize& size, int rows) {
  Net net{.rays = rows * kSamples};
  const Shape rays{1, 3, rows, kSamples};
  const int channels = size.again > 0 ? 2 * size.width : size.width, features = 2 * size.frequencies;
  const LightPixels pixels{net.input("features", noise({1, channels, kHeight / 2, kWidth / 2}, 1)),
                           net.input("surface", noise({1, channels, kHeight, kWidth}, 2))};
  const Value hit = net.input("hit", hits({1, 1, rows, kSamples})), direction = net.input("direction", noise(rays, 4)),
              photo = net.input("photo", Tensor(Shape{1, 3, kHeight, kWidth}, 0.5));
  net.composed = in_view_light({*net.graph, false, "local"}, pixels, hit, direction, photo, size);

  const auto weight = [&](const std::string& name, int out, int in) {
    net.flops += 2.0 * out * in;
    return net.input(name, noise({out, in, 1, 1}, 5, std::sqrt(6.0 / in)));
  };
  LightMlp mlp;
  mlp.again = size.again;
  for (int layer = 0; layer < size.layers; ++layer) {
    if (layer > 0) mlp.hidden.push_back(weight(fmt::format("hidden{}", layer), size.width, size.width));
    if (layer == 0 || (size.again > 0 && layer == size.again))
      mlp.direction.push_back(weight(fmt::format("direction{}", layer), size.width, features));
    mlp.biases.push_back(net.input(fmt::format("bias{}", layer), noise({1, size.width, 1, 1}, 7)));
  }
  mlp.out = weight("out", 3, size.width), mlp.out_bias = net.input("out_bias", noise({1, 3, 1, 1}, 8));
  net.before = pixel_rows(pixels.surface, pixels.features);
  const Value frequencies = net.input("frequencies", noise({size.frequencies, 3, 1, 1}, 6));
  net.fused = ask_mlp(mlp, frequencies, net.graph->input("rows", net.before.shape()), hit, direction, {});
  return net;
}

Net out_of_view(const OutOfViewSize& size, int rows) {
  Net net{.rays = rows * kSamples};
  const Shape rays{1, 3, rows, kSamples};
  const Value points = net.input("points", noise(rays, 1)), direction = net.input("direction", noise(rays, 2)),
              range = net.input("range", Tensor(Shape{1, 3, 1, 1}, std::vector<double>{3, 1, 4}));
  if (size.form == OutOfViewForm::Shells) {
    const ShellsSize& s = size.shells;
    const Value shells = net.input("shells", Tensor(Shape{s.count, 4, s.rows, s.columns}, 0.5));
    net.composed = out_of_view_light({{}, {}, shells, {}}, points, direction, range, size);
    net.fused = ask_shells(shells, points, direction, range, {}, shell_radii(s));
    return net;
  }
  std::vector<int> widths{3 + 6 * size.octaves};
  widths.insert(widths.end(), size.hidden.begin(), size.hidden.end());
  widths.push_back(4);
  LightField field;
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    net.flops += 2.0 * widths[i] * widths[i + 1] * size.march.segments;
    const double deviation = std::sqrt(1.0 / widths[i]);  // thin enough for rays to go all the way
    field.weights.push_back(
        net.input(fmt::format("weight{}", i), noise({widths[i + 1], widths[i], 1, 1}, 5, deviation)));
    field.biases.push_back(net.input(fmt::format("bias{}", i), noise({1, widths[i + 1], 1, 1}, 6, 0.1)));
  }
  net.composed = out_of_view_light(field, points, direction, range, size);
  net.fused = ask_field(field.weights, field.biases, points, direction, range, {},
                        {size.march, size.octaves, size.released_output});
  return net;
}

OutOfViewSize spheres() {
  OutOfViewSize size = out_of_view_size("compact");
  size.form = OutOfViewForm::Shells;
  return size;
}

/// What is timed, made when its turn comes.
constexpr std::pair<const char*, Net (*)()> kNets[]{
    {"in view, compact", [] { return in_view(in_view_size("compact"), 256); }},
    {"in view, paper", [] { return in_view(in_view_size("paper"), 64); }},
    {"field, compact", [] { return out_of_view(out_of_view_size("compact"), 256); }},
    {"field, paper", [] { return out_of_view(out_of_view_size("paper"), 64); }},
    {"painted spheres", [] { return out_of_view(spheres(), 1024); }},
};

std::vector<double> value_seconds(Device& device, const Net& net, Value value, const Executor* before, int runs = 0) {
  const auto states = std::make_shared<States>(device);
  states->initialise(*net.graph, 1);
  Executor executor(compile(*net.graph, {value}, device), states);
  for (const auto& [name, tensor] : net.feeds) executor.feed(name, tensor);
  if (before) executor.bind("rows", before->view(net.before));
  return seconds_of_runs(device, executor, runs);
}

/// Seconds of the one kernel alone.
std::vector<double> fused_seconds(Device& device, const Net& net, int runs = 0) {
  std::unique_ptr<Executor> before;
  if (net.before) {
    before = std::make_unique<Executor>(compile(*net.graph, {net.before}, device));
    for (const auto& [name, tensor] : net.feeds) before->feed(name, tensor);
    before->run();
  }
  return value_seconds(device, net, net.fused, before.get(), runs);
}

}  // namespace

RaySeconds light_ray_seconds(Device& device, const LightSizes& sizes) {
  constexpr int rows = 256;
  const auto million = [&](const Net& net) { return best_of(fused_seconds(device, net)) / net.rays * 1e6; };
  return {million(in_view(sizes.in_view, rows)), million(out_of_view(sizes.out_of_view, rows))};
}

nlohmann::ordered_json bench_mlp(Device& device, const BenchOptions& options) {
  nlohmann::ordered_json result{{"device", device.info().name}, {"nets", nlohmann::ordered_json::array()}};
  if (!options.quiet)
    fmt::print("Nets in one kernel\n{:<24}{:>12}{:>7}  {:<8}{:>12}{:>7}{:>5}\n", "net", "MFLOP/ray", "peak", "tile",
               "ms", "GFLOP/s", "peak");
  for (const auto& [name, make] : kNets) {
    const Net net = make();
    if (net.flops == 0) continue;
    const double fma = measure_ceilings(device).fma_gflops, flops = net.flops * net.rays;
    std::vector<BenchRow> rows;
    for_tiles(device, options, [&](const std::string& tile) {
      rows.push_back({tile, {fused_seconds(device, net, options.runs)}});
    });
    const double peak = peak_gflops(fma, flops, rows);
    nlohmann::ordered_json seconds, runs;
    for (const BenchRow& row : rows) {
      seconds[row.kernels] = best_of(row.passes[0]), runs[row.kernels] = row.passes[0];
      if (!options.quiet)
        fmt::print("{:<24}{:>12.3f}{:>7.0f}  {:<8}{}\n", name, net.flops * 1e-6, peak, row.kernels,
                   row_text(row, flops, peak));
    }
    std::fflush(stdout);
    result["nets"].push_back({{"name", name},
                              {"rays", net.rays},
                              {"flops_per_ray", net.flops},
                              {"peak_gflops", peak},
                              {"seconds", seconds},
                              {"runs", runs}});
  }
  return result;
}

nlohmann::ordered_json bench_light(Device& device, const BenchOptions& options) {
  nlohmann::ordered_json result;
  result["device"] = device.info().name;
  result["nets"] = nlohmann::ordered_json::array();
  if (!options.quiet)
    fmt::print(
        "Light at inference: million rays/s, GFLOP/s of products and % of the peak measured beside it\n"
        "{:<24}{:>12}{:>8}{:>26}{:>26}{:>8}\n",
        "net", "MFLOP/ray", "peak", "one kernel", "composed of ops", "ratio");
  for (const auto& [name, make] : kNets) {
    const Net net = make();
    const double peak = measure_ceilings(device).fma_gflops;
    const double fused = best_of(fused_seconds(device, net)),
                 composed = best_of(value_seconds(device, net, net.composed, nullptr));
    const auto columns = [&](double seconds) {
      const double gflops = net.flops * net.rays / seconds * 1e-9;
      const std::string of_peak = net.flops > 0 ? fmt::format("{:>8.0f}{:>5.0f}%", gflops, 100 * gflops / peak)
                                                : fmt::format("{:>8}{:>6}", "-", "-");
      return fmt::format("{:>12.3f}{}", net.rays / seconds * 1e-6, of_peak);
    };
    if (!options.quiet) {
      fmt::print("{:<24}{:>12.3f}{:>8.0f}{}{}{:>8.2f}\n", name, net.flops * 1e-6, peak, columns(fused),
                 columns(composed), composed / fused);
      std::fflush(stdout);
    }
    result["nets"].push_back({{"name", name},
                              {"rays", net.rays},
                              {"flops_per_ray", net.flops},
                              {"peak_gflops", peak},
                              {"seconds", {{"fused", fused}, {"composed", composed}}}});
  }
  return result;
}

}  // namespace clerestory
