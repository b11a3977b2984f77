#include "experiments/bench/conv_bench.hpp"

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/cl/ceilings.hpp"
#include "host/ops/nn/conv.hpp"

namespace clerestory {
namespace {

struct Layer {
  std::string name;
  Shape x, w;
  int stride = 1, pad = 1;
  Shape y() const { return {x.n, w.n, (x.h + 2 * pad - w.h) / stride + 1, (x.w + 2 * pad - w.w) / stride + 1}; }
  double flops() const { return 2.0 * static_cast<double>(y().count()) * static_cast<double>(w.item()); }
};

struct Group {
  std::string name;
  std::vector<Layer> layers;
};

Layer decoder_step(const std::string& name, int batch, int in, int out, int height, int width) {
  return {name, {batch, in, height, width}, {out, in, 3, 3}};
}

// The decoders' steps at a picture of height x width; `levels` are the channels that join c1 to c4 on the way up.
std::vector<Layer> decoder_steps(int batch, const std::vector<int>& levels, const std::vector<int>& out, int top,
                                 int height, int width) {
  std::vector<Layer> layers;
  for (int i = 0; i < 5; ++i) {
    const int scale = 16 >> i;
    const auto at = static_cast<std::size_t>(i);
    const int in = i == 0 ? top : out[at - 1] + levels[at - 1];
    layers.push_back(decoder_step(fmt::format("c{}", i + 1), batch, in, out[at], height / scale, width / scale));
  }
  layers.push_back({"out", {batch, out[4], height + 2, width + 2}, {3, out[4], 3, 3}, 1, 0});
  return layers;
}

// First convolution, and per dense block the 1x1 of its middle layer and its 3x3.
std::vector<Layer> compact_encoder(int batch, int height, int width) {
  std::vector<Layer> layers{{"first 7x7", {batch, 3, height, width}, {32, 3, 7, 7}, 2, 3}};
  const int growth = 16, counts[] = {6, 12, 24, 16};
  int channels = 32, scale = 2;
  for (int b = 0; b < 4; ++b) {
    const int h = height / scale, w = width / scale, middle = channels + growth * (counts[b] / 2);
    layers.push_back({fmt::format("block{} 1x1", b + 1), {batch, middle, h, w}, {4 * growth, middle, 1, 1}, 1, 0});
    layers.push_back({fmt::format("block{} 3x3", b + 1), {batch, 4 * growth, h, w}, {growth, 4 * growth, 3, 3}});
    channels = channels + growth * counts[b];
    if (b == 3) break;
    layers.push_back(
        {fmt::format("transition{}", b + 1), {batch, channels, h, w}, {channels / 2, channels, 1, 1}, 1, 0});
    channels /= 2, scale *= 2;
  }
  return layers;
}

// Of preset lite the 1x1 convolutions of every stage's first wide block, and the steps of the shared decoder.
std::vector<Layer> lite(int batch, int height, int width) {
  constexpr int channels[] = {16, 24, 40, 80, 112, 192, 320}, scales[] = {2, 4, 8, 16, 16, 32, 32};
  std::vector<Layer> layers{{"project 0", {batch, 32, height / 2, width / 2}, {16, 32, 1, 1}, 1, 0}};
  for (int s = 1; s < 7; ++s) {
    const int in = channels[s - 1], out = channels[s], wide = 6 * in, before = scales[s - 1], after = scales[s];
    layers.push_back(
        {fmt::format("expand {}", s), {batch, in, height / before, width / before}, {wide, in, 1, 1}, 1, 0});
    layers.push_back(
        {fmt::format("project {}", s), {batch, wide, height / after, width / after}, {out, wide, 1, 1}, 1, 0});
  }
  constexpr int in[] = {320, 240, 168, 120, 80, 38}, steps[] = {128, 128, 96, 64, 32, 24};
  for (int i = 0; i < 6; ++i)
    layers.push_back(
        decoder_step(fmt::format("c{}", i + 1), batch, in[i], steps[i], height >> (5 - i), width >> (5 - i)));
  return layers;
}

std::vector<Group> groups() {
  const auto compact = [](int batch, int height, int width) {
    std::vector<Layer> layers = compact_encoder(batch, height, width);
    for (Layer& l : decoder_steps(batch, {256, 128, 64, 32}, {128, 64, 32, 16, 16}, 512, height, width))
      layers.push_back(std::move(l));
    return layers;
  };
  // Pictures are padded to a multiple of 32; the paper's layers are taken at their own size.
  return {{"paper, 320x240, batch 1", decoder_steps(1, {512, 256, 128, 64}, {512, 256, 128, 64, 64}, 1024, 240, 320)},
          {"compact, 160x128, batch 8", compact(8, 128, 160)},
          {"compact, 320x256, batch 1", compact(1, 256, 320)},
          {"lite, 160x128, batch 8", lite(8, 128, 160)}};
}

enum class Pass { Forward, Data, Weights };
constexpr const char* pass_names[] = {"forward", "data", "weights"};

// One pass, with what it gives in double.
struct ExactPass {
  Graph graph;
  Value result;
  std::map<std::string, Tensor> feeds;
  BenchTruth truth;

  ExactPass(Device& device, const Layer& layer, Pass pass) {
    const Value x = graph.input("x", layer.x), w = graph.input("w", layer.w), dy = graph.input("dy", layer.y());
    const Value y = conv(x, w, {}, {layer.stride, layer.pad});
    result = pass == Pass::Forward
                 ? y
                 : gradient(std::vector{y}, std::vector{dy}, std::vector{pass == Pass::Data ? x : w})[0];
    for (const auto& [name, shape] : {std::pair{"x", layer.x}, std::pair{"w", layer.w}, std::pair{"dy", layer.y()}})
      feeds[name] = noise(shape, static_cast<std::uint32_t>(name[0]));
    truth = truth_of(device, graph, result, feeds);
  }
};

using ExactPasses = std::vector<std::unique_ptr<ExactPass>>;
ExactPasses exact_passes(Device& device, const Layer& layer) {
  ExactPasses passes;
  for (const Pass pass : {Pass::Forward, Pass::Data, Pass::Weights})
    passes.push_back(std::make_unique<ExactPass>(device, layer, pass));
  return passes;
}

// Of plans that compute one pass, packing counted.
BenchRow all_passes(Device& device, const ExactPasses& passes, const std::string& gemm, const std::string& name,
                    int runs) {
  BenchRow row{name, {}};
  for (const auto& pass : passes) {
    Executor executor(compile(pass->graph, {pass->result}, device, {.gemm = gemm}));
    for (const auto& [input, tensor] : pass->feeds) executor.feed(input, tensor);
    row.passes.push_back(seconds_of_runs(device, executor, runs));
    row.errors.push_back(error_of(executor.fetch_floats(pass->result), pass->truth));
  }
  return row;
}

}  // namespace

nlohmann::ordered_json bench_conv(Device& device, const BenchOptions& options) {
  nlohmann::ordered_json result{{"device", device.info().name}, {"groups", nlohmann::ordered_json::array()}};
  // CLBlast compiles its kernels at its first product.
  for_clblast(device, options, [&](const std::string&) {
    all_passes(device, exact_passes(device, {"warm-up", {1, 8, 8, 8}, {8, 8, 3, 3}}), "clblast", "", 1);
  });
  bool any = false;
  for (const Group& group : groups()) {
    if (!options.quiet)
      fmt::print(
          "{}: milliseconds, GFLOP/s and % of the peak measured beside it; errors against double, relative to the sum\n"
          "of magnitudes, of the worst pass\n{:<12}{:>18}{:>16}{:>7}{:>6}  {:<8}{:>24}{:>24}{:>24}{:>10}{:>9}\n",
          group.name, "layer", "input", "weights", "GFLOP", "peak", "kernels", "forward", "backward data",
          "backward weights", "largest", "rms");
    nlohmann::ordered_json shapes = nlohmann::ordered_json::array();
    for (const Layer& layer : group.layers) {
      if ((group.name + ": " + layer.name).find(options.only) == std::string::npos) continue;
      const double fma = measure_ceilings(device).fma_gflops;
      const ExactPasses passes = exact_passes(device, layer);
      std::vector<BenchRow> rows;
      for_tiles(device, options, [&](const std::string& tile) {
        rows.push_back(all_passes(device, passes, options.own, tile, options.runs));
      });
      for_clblast(device, options, [&](const std::string& name) {
        rows.push_back(all_passes(device, passes, "clblast", name, options.runs));
      });
      const double peak = peak_gflops(fma, layer.flops(), rows);
      nlohmann::ordered_json seconds, runs, errors;
      for (const BenchRow& row : rows) {
        for (std::size_t pass = 0; pass < row.passes.size(); ++pass) {
          seconds[row.kernels][pass_names[pass]] = best_of(row.passes[pass]);
          runs[row.kernels][pass_names[pass]] = row.passes[pass];
          errors[row.kernels][pass_names[pass]] = {{"largest", row.errors[pass].largest},
                                                   {"rms", row.errors[pass].rms}};
        }
        const BenchError worst = largest_error(row);
        if (!options.quiet)
          fmt::print("{:<12}{:>18}{:>16}{:>7.2f}{:>6.0f}  {:<8}{}{:>10.1e}{:>9.1e}\n", layer.name, layer.x.text(),
                     layer.w.text(), layer.flops() / 1e9, peak, row.kernels, row_text(row, layer.flops(), peak),
                     worst.largest, worst.rms);
      }
      std::fflush(stdout);
      const Shape &x = layer.x, &w = layer.w;
      shapes.push_back({{"name", layer.name},
                        {"x", {x.n, x.c, x.h, x.w}},
                        {"w", {w.n, w.c, w.h, w.w}},
                        {"stride", layer.stride},
                        {"pad", layer.pad},
                        {"flops", layer.flops()},
                        {"peak_gflops", peak},
                        {"tile", options.tiles.front()},
                        {"seconds", seconds},
                        {"runs", runs},
                        {"errors", errors}});
    }
    any |= !shapes.empty();
    result["groups"].push_back({{"name", group.name}, {"shapes", shapes}});
  }
  if (!any) throw usage_error("no layer is named so", "--only", options.only, "a part of GROUP: LAYER");
  return result;
}

}  // namespace clerestory
