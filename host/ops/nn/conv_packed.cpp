// The packed backend: our own kernels, nn/conv_cpu.cl or nn/conv_gpu.cl.
#include <algorithm>
#include <array>

#include "host/cl/tile.hpp"
#include "host/ops/nn/conv_backend.hpp"
#include "host/ops/nn/winograd_blocking.hpp"

namespace clerestory {
namespace {

constexpr std::size_t scratch_elements = 128 * 1024;  // half a megabyte of floats: half of a usual L2 cache
// Of kernels/nn/conv_gpu.cl: a tile's outputs and columns, eight of each to a work-item, and steps of a block.
constexpr int gpu_rows = 64, gpu_columns = 128, gpu_each = 8, gpu_depth = 16;
constexpr std::size_t gpu_groups = 512;  // that keep the largest of today busy: four to each of 132 multiprocessors

bool on_gpu(const Launch& l, ConvKernels kernels) {
  const DeviceInfo& device = l.device.info();
  const bool fits = device.max_group >= (gpu_columns / gpu_each) * (gpu_rows / gpu_each);
  return kernels == ConvKernels::Gpu || (kernels == ConvKernels::ByPlan && !device.cpu && fits);
}

std::size_t scratch(const Launch& l, const ConvSpec& spec) {
  const std::size_t wanted = spec.scratch > 0 ? static_cast<std::size_t>(spec.scratch) : scratch_elements;
  return std::min(wanted, l.device.info().local_room() / real_size(l.precision));
}

std::size_t blocks(long count, int size) { return static_cast<std::size_t>((count + size - 1) / size); }

Range gpu_range(int outputs, long columns, int layers) {
  constexpr std::size_t x = gpu_columns / gpu_each, y = gpu_rows / gpu_each;
  return {{blocks(columns, gpu_columns) * x, blocks(outputs, gpu_rows) * y, static_cast<std::size_t>(layers)},
          {x, y, 1},
          true};
}

}  // namespace

bool use_clblast(const Launch& l, ConvKernels kernels) {
  if (kernels != ConvKernels::ByPlan) return kernels == ConvKernels::Clblast;
  return l.gemm == "clblast";
}

int item_pitch(const TensorView& t) { return t.shape.n > 1 ? t.stride : static_cast<int>(t.shape.item()); }

std::size_t packed_elements(const ConvGeometry& g) {
  if (is_winograd(g)) return winograd_elements(g);
  return blocks(g.outputs, conv_tile) * conv_tile * static_cast<std::size_t>(g.depth());
}

namespace {

// Whether the weights of an output lie in the order in which a product on a CPU reads them. Rows a multiple of 4 KiB
// apart would compete for one set of the first cache.
bool read_as_stored(const ConvPass& pass) {
  const ConvGeometry& g = pass.geometry;
  const ConvTaps& t = pass.taps;
  const bool in_order = t.first_x == 0 && t.first_y == 0 && t.step_x == 1 && t.step_y == 1 &&
                        t.channel_pitch == g.taps() && (g.taps() == 1 || t.kernel_w == g.taps_x);
  return in_order && t.output_pitch % 1024 != 0;
}

void pack_weights(Launch& l, const ConvPass& pass, const TensorView& weights, const TensorView& packed) {
  const ConvGeometry& g = pass.geometry;
  const ConvTaps& t = pass.taps;
  if (g.taps() == 0) return;
  const std::size_t channels = static_cast<std::size_t>(g.channels), panels = blocks(g.outputs, conv_tile);
  const bool panels_first = t.output_pitch < t.channel_pitch;
  l.run("nn/conv_pack.cl", "conv_pack_weights",
        panels_first ? Range::of2(panels, channels) : Range::of2(channels, panels), weights, packed, g, t.output_pitch,
        t.channel_pitch, t.kernel_w, std::array{t.first_x, t.first_y}, std::array{t.step_x, t.step_y},
        static_cast<int>(panels_first));
}

bool wants_winograd(const Launch& l, const ConvSpec& spec, const ConvGeometry& g, bool preferred) {
  if (spec.kernels == ConvKernels::Winograd) return is_winograd(g);
  return spec.kernels == ConvKernels::ByPlan && l.device.info().cpu && l.gemm == "packed" && preferred;
}

std::optional<WinogradBlocking> winograd_blocking(const Launch& l, const ConvGeometry& g, int batch,
                                                  const ConvSpec& spec) {
  if (!wants_winograd(l, spec, g, prefers_winograd(g))) return {};
  return block_winograd(g, batch, scratch(l, spec), l.device.info().compute_units);
}

void run_winograd(Launch& l, const ConvPass& pass, const WinogradBlocking& b, const TensorView& source,
                  const SourceNorm* norm, const TensorView& weights, const TensorView* bias, const TensorView& target,
                  const TensorView& transformed) {
  const ConvGeometry& g = pass.geometry;
  const ConvTaps& t = pass.taps;
  l.run("nn/conv_winograd.cl", "conv_winograd_weights",
        Range::of2(static_cast<std::size_t>(g.channels), blocks(g.outputs, conv_tile)), weights, transformed, g,
        t.output_pitch, t.channel_pitch, t.kernel_w, std::array{t.first_x, t.first_y}, std::array{t.step_x, t.step_y});
  const std::size_t real = real_size(l.precision);
  const Range range{{static_cast<std::size_t>(b.bands()), blocks(g.outputs, b.chunk), 1}, {1, 1, 1}};
  with_source(norm, [&](const Defines& defines, const auto&... map) {
    l.run_with(tile_defines(l.device, defines), "nn/conv_winograd.cl", "conv_winograd", range, source, map...,
               transformed, bias ? *bias : weights, target, g, static_cast<int>(bias != nullptr), b,
               Arg::local(b.panel() * real), Arg::local(b.sums() * real), Arg::local(b.lines() * real));
  });
}

void run_winograd_weights(Launch& l, const ConvGeometry& g, const WinogradBlocking& b, const TensorView& source,
                          const SourceNorm* norm, const TensorView& target, const TensorView& gradient) {
  const std::size_t real = real_size(l.precision);
  const Range range{
      {blocks(g.channels, b.channel_block), static_cast<std::size_t>(b.partials), blocks(g.outputs, b.chunk)},
      {1, 1, 1}};
  with_source(norm, [&](const Defines& defines, const auto&... map) {
    l.run_with(tile_defines(l.device, defines), "nn/conv_winograd.cl", "conv_winograd_gradient", range, source, map...,
               target, gradient, g, b, Arg::local(b.panel() * real), Arg::local(b.target_rows() * real),
               Arg::local(b.weight_sums() * real), Arg::local(b.weight_lines() * real));
  });
}

std::optional<WinogradBlocking> winograd_weights_blocking(const Launch& l, const ConvGeometry& g, int batch,
                                                          const ConvSpec& spec) {
  const bool wanted = wants_winograd(l, spec, g, prefers_winograd_weights(g, batch));
  return wanted ? block_winograd_weights(g, batch, scratch(l, spec)) : std::nullopt;
}

}  // namespace

void run_packed(Launch& l, const ConvPass& pass, int batch, const ConvSpec& spec, const TensorView& source,
                const SourceNorm* norm, const TensorView& weights, const TensorView* bias, const TensorView& target,
                std::size_t at) {
  const ConvGeometry& g = pass.geometry;
  if (const auto cut = winograd_blocking(l, g, batch, spec))
    return run_winograd(l, pass, *cut, source, norm, weights, bias, target, l.workspace.from(at));
  const bool gpu = on_gpu(l, spec.kernels), stored = !gpu && read_as_stored(pass);
  const TensorView read = stored ? weights : l.workspace.from(at);
  if (!stored) pack_weights(l, pass, weights, read);
  const TensorView& some_bias = bias ? *bias : weights;
  const int has_bias = bias != nullptr;
  if (gpu) {
    const Range range = gpu_range(g.outputs, g.positions(), batch);
    with_source(norm, [&](const Defines& defines, const auto&... map) {
      l.run_with(defines, "nn/conv_gpu.cl", "conv_gpu", range, source, map..., read, some_bias, target, g, has_bias);
    });
    return;
  }
  const ConvBlocking b = block_pass(g, batch, scratch(l, spec), l.device.info().compute_units);
  const std::size_t real = real_size(l.precision);
  const Range range{{static_cast<std::size_t>(b.bands), blocks(g.outputs, b.chunk), static_cast<std::size_t>(batch)},
                    {1, 1, 1}};
  const int weights_pitch = stored ? pass.taps.output_pitch : g.depth();
  with_source(norm, [&](Defines defines, const auto&... map) {
    if (stored) defines["WEIGHTS_AS_STORED"] = "1";
    l.run_with(tile_defines(l.device, defines), "nn/conv_cpu.cl", "conv_cpu", range, source, map..., read,
               weights_pitch, some_bias, target, g, has_bias, b,
               Arg::local(static_cast<std::size_t>(b.channel_block) * b.plane * real),
               Arg::local(static_cast<std::size_t>(b.chunk) * b.positions * real),
               Arg::local(static_cast<std::size_t>(b.channel_block) * std::max(1, g.taps()) * sizeof(int)));
  });
}

namespace {

/// Partial sums of backward weights on a GPU: as many as fill it where the weights alone are too few tiles.
std::size_t gpu_partials(const ConvGeometry& g, int batch) {
  const std::size_t tiles = blocks(g.outputs, gpu_rows) * blocks(g.depth(), gpu_columns);
  const std::size_t stretches = blocks(g.positions(), gpu_depth) * static_cast<std::size_t>(batch);
  return std::min((gpu_groups + tiles - 1) / tiles, stretches);
}

}  // namespace

std::size_t partial_elements(const ConvGeometry& g, int batch) {
  return std::max(static_cast<std::size_t>(most_partials(g)), gpu_partials(g, batch)) * g.outputs * g.depth();
}

void run_packed_weights(Launch& l, const ConvGeometry& g, int batch, const ConvSpec& spec, const TensorView& source,
                        const SourceNorm* norm, const TensorView& target, const TensorView* bias,
                        const TensorView& gradient, int row_pitch) {
  const bool gpu = on_gpu(l, spec.kernels);
  const auto winograd = gpu ? std::nullopt : winograd_weights_blocking(l, g, batch, spec);
  ConvBlocking b;
  if (!gpu && !winograd) b = block_weights(g, batch, scratch(l, spec));
  const int partials = gpu ? static_cast<int>(gpu_partials(g, batch)) : winograd ? winograd->partials : b.partials;
  const bool direct = partials == 1 && !bias && row_pitch == g.depth();
  const TensorView& sums = direct ? gradient : l.workspace;
  if (gpu) {
    const Range range = gpu_range(g.outputs, g.depth(), partials);
    with_source(norm, [&](const Defines& defines, const auto&... map) {
      l.run_with(defines, "nn/conv_gpu.cl", "conv_weights_gpu", range, source, map..., target, sums, g, batch,
                 partials);
    });
  } else if (winograd) {
    run_winograd_weights(l, g, *winograd, source, norm, target, sums);
  } else {
    const std::size_t real = real_size(l.precision);
    const WeightsForm form = weights_form(g, b);
    const Range range{
        {blocks(g.channels, b.channel_block), static_cast<std::size_t>(partials), blocks(g.outputs, b.chunk)},
        {1, 1, 1}};
    with_source(norm, [&](const Defines& defines, const auto&... map) {
      l.run_with(tile_defines(l.device, defines), "nn/conv_cpu.cl", form.kernel, range, source, map..., target, sums, g,
                 b, Arg::local(form.panel * real), Arg::local(form.rows * real), Arg::local(form.sums * real),
                 Arg::local(static_cast<std::size_t>(b.channel_block) * g.taps() * sizeof(int)));
    });
  }
  if (direct) return;
  const std::size_t count = static_cast<std::size_t>(g.outputs) * g.depth();
  l.run("nn/conv_pack.cl", "conv_sum_partials", Range::of(count), l.workspace, bias ? *bias : gradient, gradient,
        g.outputs, g.depth(), row_pitch, partials, static_cast<int>(bias != nullptr));
}

}  // namespace clerestory
