#include "host/ops/nn/conv_geometry.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/error.hpp"
#include "host/math/integers.hpp"

namespace clerestory {
namespace {

constexpr int position_tile = 16;
constexpr int most_positions = 512, fewest_positions = 128;  // of a band, aimed at
// Of backward weights: their part of the target and of the panel stays in the first cache.
constexpr int outer_positions = 320, dot_positions = 640;
constexpr int most_outputs = 3 * vector_outputs;  // of the widest tile
constexpr int most_sums = 1 << 16;                // of a backward-weights group, so that they stay in the second cache
// Of sixteen elements of a panel and of the weights, in multiplications of sixteen positions (measured, memory
// counted).
constexpr double copying = 16, reading = 4;
// Of sixteen elements of the target transposed, and of sixteen elements of a partial sum written and added, in the
// same.
constexpr double transposing = 28, adding = 36;
constexpr int under_a_tile = 128;  // rows of a panel, so that what all outputs read of them stays in the first cache

// Rows of the panel are grid_w - 1 + columns wide, where `columns` are the taps of one residue. The last entries of a
// row may be the first of the next where both are padding.
int shared_padding(const ConvGeometry& g) {
  const int columns = ceil_div(g.taps_x, g.source_step), full = g.grid_w - 1 + columns;
  int shared = columns - 1;
  for (int px = 0; px < std::min(g.source_step, g.taps_x); ++px) {
    const auto pixel = [&](int entry) { return entry * g.source_step + px + g.source_x; };
    const auto is_padding = [&](int count) {
      for (int j = 0; j < count; ++j)
        if (pixel(j) >= 0 || pixel(full - 1 - j) < g.source_w) return false;
      return true;
    };
    while (!is_padding(shared)) --shared;
  }
  return shared;
}

// Rows of a band of about `wanted` positions that make the least work over the whole grid: positions rounded up to
// tiles, and the copying of panels, whose rows at the border of two bands are copied twice.
int best_rows(const ConvGeometry& g, const ConvBlocking& b, int wanted) {
  const int panels = ceil_div(g.outputs, conv_tile), halo = std::max(0, ceil_div(g.taps_y, g.source_step) - 1);
  const double copy = copying / (panels * conv_tile * std::max(1, g.taps()));
  const auto work = [&](int rows) {
    return round_up((rows - 1) * b.pitch + b.band_columns, position_tile) + copy * (rows + halo) * b.pitch;
  };
  const int fewest = std::min(g.grid_h, std::max(1, wanted / 2 / b.pitch));
  int best = fewest;
  double least = 0;
  for (int rows = fewest; rows == fewest || (rows <= g.grid_h && rows * b.pitch <= wanted + wanted / 4); ++rows) {
    const int whole = g.grid_h / rows, rest = g.grid_h % rows;
    const double total = whole * work(rows) + (rest > 0 ? work(rest) : 0);
    if (rows == fewest || total < least) best = rows, least = total;
  }
  return best;
}

int even_share(int total, int at_most) { return ceil_div(total, ceil_div(total, std::max(1, at_most))); }

// The bands, and the panel's layout for them. Backward weights multiply all positions of the last band as well, so
// theirs are even.
ConvBlocking cut_bands(const ConvGeometry& g, int batch, int wanted, bool even) {
  ConvBlocking b;
  b.batch = batch;
  b.bands_x = g.grid_w <= 2 * wanted ? 1 : ceil_div(g.grid_w, wanted);
  b.band_columns = round_up(ceil_div(g.grid_w, b.bands_x), b.bands_x > 1 ? position_tile : 1);
  b.bands_x = ceil_div(g.grid_w, b.band_columns);
  const int taps_x = std::max(1, ceil_div(g.taps_x, g.source_step)),
            taps_y = std::max(1, ceil_div(g.taps_y, g.source_step));
  b.pitch = b.band_columns - 1 + taps_x - (b.bands_x == 1 ? shared_padding(g) : 0);
  b.band_rows = even ? even_share(g.grid_h, wanted / b.pitch) : best_rows(g, b, wanted);
  b.bands = ceil_div(g.grid_h, b.band_rows) * b.bands_x;
  b.positions = round_up((b.band_rows - 1) * b.pitch + b.band_columns, position_tile);
  const int read = b.positions + (taps_y - 1) * b.pitch + taps_x - 1, written = (b.band_rows - 1 + taps_y) * b.pitch;
  b.subplane = round_up(std::max(read, written), 16);
  if (b.subplane % 64 == 0) b.subplane += 16;  // planes a multiple of 256 bytes apart compete for the same cache sets
  b.plane = b.subplane * std::min(g.source_step, std::max(1, g.taps_y)) * g.source_step;
  return b;
}

// Time of a pass in multiplications of sixteen positions, for one channel: rounds of `units` groups, each of which
// copies its panel and reads its weights for itself.
double time_of(const ConvGeometry& g, const ConvBlocking& b, int batch, int units) {
  const double outputs = static_cast<double>(b.chunk) * std::max(1, g.taps());
  const int groups = batch * b.bands * ceil_div(g.outputs, b.chunk);
  return ceil_div(groups, units) * (copying * b.plane + reading * outputs + b.positions * outputs);
}

[[noreturn]] void does_not_fit(std::size_t needed, int positions, std::size_t local_elements) {
  throw Error(ErrorKind::Device, "convolution does not fit into the device's local memory", "conv",
              fmt::format("{} elements for one channel of {} positions", needed, positions),
              fmt::format("at most {}", local_elements));
}

void check_fits(const ConvGeometry& g, const ConvBlocking& b, std::size_t local_elements) {
  const std::size_t needed = static_cast<std::size_t>(b.channel_block) * (b.plane + g.taps()) +
                             static_cast<std::size_t>(b.chunk) * b.positions;
  if (needed > local_elements) does_not_fit(needed, b.positions, local_elements);
}

// Outputs too few for vectors of them.
bool by_dot_products(const ConvGeometry& g) { return g.outputs <= conv_tile; }

std::size_t scratch_of(const ConvGeometry& g, const ConvBlocking& b) {
  return weights_form(g, b).elements() + static_cast<std::size_t>(b.channel_block) * g.taps();
}

// Most source channels of a backward-weights group of these bands and outputs, or 1 where not even that fits.
int fitting_channels(const ConvGeometry& g, ConvBlocking b, std::size_t local_elements) {
  const auto needed = [&](int channels) {
    b.channel_block = channels;
    return scratch_of(g, b);
  };
  int least = 1, beyond = g.channels + 1;
  while (beyond - least > 1) {
    const int middle = (least + beyond) / 2;
    const bool fits = needed(middle) <= local_elements && weights_form(g, b).sums <= most_sums;
    (fits ? least : beyond) = middle;
  }
  return least;
}

// What the groups of a backward-weights pass share: blocks of source channels, chunks of the outputs, partial sums over
// bands. Every block transposes the target for itself, every chunk copies the panels, and every partial is written and
// added. Of all that make the wanted groups the one of the least such work.
ConvBlocking cut_weights(const ConvGeometry& g, const ConvBlocking& bands, std::size_t local_elements) {
  const int all = bands.bands * bands.batch, vectors = ceil_div(g.outputs, vector_outputs);
  const int most = std::min(most_partials(g), all);
  const double positions = static_cast<double>(g.positions()) * bands.batch,
               halo = static_cast<double>(bands.plane) / (bands.band_rows * bands.band_columns);
  ConvBlocking best;
  double least = 0;
  for (int partials = 1; partials <= most; partials = partials < most ? std::min(2 * partials, most) : most + 1)
    for (int chunks = 1; chunks <= std::min(vectors, wanted_groups); chunks *= 2) {
      ConvBlocking b = bands;
      b.partials = partials, b.stack = std::min(bands.stack, ceil_div(all, partials));
      b.chunk = ceil_div(vectors, chunks) * vector_outputs;
      b.channel_block =
          even_share(g.channels, std::min(fitting_channels(g, b, local_elements),
                                          ceil_div(g.channels, ceil_div(wanted_groups, partials * chunks))));
      const int blocks = ceil_div(g.channels, b.channel_block), shares = ceil_div(g.outputs, b.chunk);
      const double idle = std::max(1.0, static_cast<double>(wanted_groups) / (blocks * shares * partials));
      const double product = static_cast<double>(shares) * b.chunk * g.depth() * positions;
      const double work =
          idle * (product + (transposing * blocks * g.outputs + copying * shares * halo * g.channels) * positions +
                  adding * partials * g.outputs * g.depth());
      if (least == 0 || work < least) least = work, best = b;
    }
  return best;
}

}  // namespace

ConvPass forward_pass(const ConvShape& s) {
  ConvGeometry g;
  g.channels = s.channels, g.outputs = s.outputs;
  g.source_w = s.width, g.source_plane = s.height * s.width;
  g.grid_h = s.out_height(), g.grid_w = s.out_width();
  g.target_w = g.grid_w, g.target_plane = g.grid_h * g.grid_w;
  g.taps_y = s.kernel_h, g.taps_x = s.kernel_w;
  g.source_step = s.stride, g.source_y = g.source_x = -s.pad;
  if (g.taps() == 1 && s.stride == 1 && s.pad == 0) {  // rows do not matter: a product with plane columns
    g.source_w = g.target_w = g.grid_w = g.source_plane;
    g.grid_h = 1;
  }
  const int taps = s.kernel_h * s.kernel_w;
  return {g, {s.weights_pitch, taps, s.kernel_w, 0, 0, 1, 1}};
}

std::vector<ConvPass> backward_data_passes(const ConvShape& s) {
  if (s.kernel_h == 1 && s.kernel_w == 1 && s.stride == 1 && s.pad == 0) {
    ConvPass pass = forward_pass(s);
    std::swap(pass.geometry.channels, pass.geometry.outputs);
    std::swap(pass.taps.output_pitch, pass.taps.channel_pitch);
    return {pass};
  }
  // Input pixel Y = py + stride*gy receives from output row (Y + pad - ky)/stride for each tap ky = first + stride*j
  // with the right residue: rows gy + base - j. Ascending taps ty = count-1-j make it a convolution.
  struct Axis {
    int count, source, first, step, grid;
  };
  const auto axis = [&](int p, int kernel, int size) -> Axis {
    const int first = (p + s.pad) % s.stride, count = first < kernel ? ceil_div(kernel - first, s.stride) : 0;
    return {count, (p + s.pad - first) / s.stride - (count - 1), first + s.stride * (count - 1), -s.stride,
            ceil_div(size - p, s.stride)};
  };
  std::vector<ConvPass> passes;
  for (int py = 0; py < std::min(s.stride, s.height); ++py)
    for (int px = 0; px < std::min(s.stride, s.width); ++px) {
      const Axis y = axis(py, s.kernel_h, s.height), x = axis(px, s.kernel_w, s.width);
      ConvGeometry g;
      g.channels = s.outputs, g.outputs = s.channels;
      g.source_w = s.out_width(), g.source_plane = s.out_height() * s.out_width();
      g.target_w = s.width, g.target_plane = s.height * s.width;
      g.grid_h = y.grid, g.grid_w = x.grid;
      g.taps_y = x.count ? y.count : 0, g.taps_x = y.count ? x.count : 0;
      g.source_y = y.source, g.source_x = x.source;
      g.target_step = s.stride, g.target_y = py, g.target_x = px;
      const int taps = s.kernel_h * s.kernel_w;
      passes.push_back({g, {taps, s.weights_pitch, s.kernel_w, y.first, x.first, y.step, x.step}});
    }
  return passes;
}

ConvBlocking block_pass(const ConvGeometry& g, int batch, std::size_t local_elements, int units) {
  const int panels = ceil_div(g.outputs, conv_tile);
  ConvBlocking best;
  double least = 0;
  for (int wanted = most_positions; least == 0 || wanted >= fewest_positions; wanted /= 2) {
    ConvBlocking b = cut_bands(g, batch, wanted, false);
    const std::size_t per_channel = static_cast<std::size_t>(b.plane + g.taps());
    for (int chunks = 1; chunks <= panels; ++chunks) {
      b.chunk = ceil_div(panels, chunks) * conv_tile;
      const std::size_t sums = static_cast<std::size_t>(b.chunk) * b.positions;
      if (sums + per_channel > local_elements || (sums > local_elements / 2 && b.chunk > conv_tile)) continue;
      const double time = time_of(g, b, batch, units);
      if (least > 0 && time >= least) continue;
      const int fit = static_cast<int>((local_elements - sums) / per_channel);
      b.channel_block = even_share(g.channels, std::min(fit, std::max(1, under_a_tile / std::max(1, g.taps_y))));
      best = b, least = time;
    }
    if (least == 0 && wanted <= position_tile) check_fits(g, b, local_elements);
  }
  check_fits(g, best, local_elements);
  return best;
}

int most_partials(const ConvGeometry& g) {
  const long groups = (static_cast<long>(g.outputs) * g.depth() + most_sums - 1) / most_sums;
  return static_cast<int>((wanted_groups + groups - 1) / groups);
}

WeightsForm weights_form(const ConvGeometry& g, const ConvBlocking& b) {
  const int depth = b.channel_block * g.taps();
  const std::size_t panel = static_cast<std::size_t>(b.stack) * b.channel_block * b.plane;
  if (by_dot_products(g))
    return {"conv_weights_dot", panel, static_cast<std::size_t>(conv_tile) * b.positions,
            static_cast<std::size_t>(round_up(depth, 3)) * conv_tile * position_tile};
  return {"conv_weights_outer", panel, static_cast<std::size_t>(b.stack) * b.band_rows * b.band_columns * most_outputs,
          static_cast<std::size_t>(round_up(depth, conv_tile)) * b.chunk};
}

ConvBlocking block_weights(const ConvGeometry& g, int batch, std::size_t local_elements) {
  const bool dot = by_dot_products(g);
  for (int wanted = dot ? dot_positions : outer_positions;; wanted /= 2) {
    ConvBlocking b = cut_bands(g, batch, wanted, true);
    if (!dot && b.bands == 1) b.stack = std::clamp(wanted / (b.band_rows * b.band_columns), 1, batch);
    b = cut_weights(g, b, local_elements);
    if (scratch_of(g, b) <= local_elements) return b;
    if (wanted <= position_tile) does_not_fit(scratch_of(g, b), b.positions, local_elements);
  }
}

}  // namespace clerestory
