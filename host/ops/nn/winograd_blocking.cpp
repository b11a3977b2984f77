#include "host/ops/nn/winograd_blocking.hpp"

#include <algorithm>

#include "host/math/integers.hpp"

namespace clerestory {
namespace {

constexpr int position_tile = 16;
constexpr int most_positions = 192;
// A pass of less is faster as a direct sum: transforms are then more than is saved.
constexpr int fewest_channels = 16, fewest_outputs = 16, fewest_positions = 256;

// In multiplications of sixteen positions (measured): of sixteen tiles of a channel transformed, of sixteen tiles of an
// output transformed back, of sixteen sums read and written, of sixteen weights read.
constexpr double transforming = 120, back = 110, summing = 2, reading = 4;

// Backward weights: vectors run over outputs. A group has so many weights at most, so that their sums stay in the
// second cache, and there are as many groups as direct ones aim at (host/ops/nn/conv_geometry.cpp).
constexpr int vector_outputs = 16, most_vectors = 3;
constexpr int most_weights = 4096, wanted_groups = 16;
// In the same multiplications: of a tile of sixteen outputs transformed, of sixteen weights of a partial sum written
// and added.
constexpr double transforming_target = 40, adding = 3;

// Rows of tiles are whole vectors of the widest tile: a row of few tiles costs as much as a full one.
double vectors_of_rows(const WinogradBlocking& b) {
  return static_cast<double>(b.band_rows) * ceil_div(b.band_columns, position_tile);
}

double time_of(const ConvGeometry& g, const WinogradBlocking& b, int units) {
  const double vectors = vectors_of_rows(b), positions = static_cast<double>(b.positions) / position_tile;
  const double each =
      g.channels * vectors * transforming + b.chunk * vectors * back +
      16.0 * b.chunk *
          (g.channels * (positions + reading / 16) + positions * summing * ceil_div(g.channels, b.channel_block));
  return ceil_div(b.bands() * ceil_div(g.outputs, b.chunk), units) * each;
}

WinogradBlocking cut_bands(const ConvGeometry& g, int batch, int wanted) {
  WinogradBlocking b;
  b.tiles_x = ceil_div(g.grid_w, 2), b.tiles_y = ceil_div(g.grid_h, 2), b.rows = batch * b.tiles_y;
  b.bands_x = ceil_div(b.tiles_x, wanted);
  b.band_columns = b.bands_x == 1 ? b.tiles_x : round_up(ceil_div(b.tiles_x, b.bands_x), position_tile);
  b.bands_x = ceil_div(b.tiles_x, b.band_columns);
  b.band_rows = std::clamp(wanted / b.band_columns, 1, b.rows);
  b.band_rows = ceil_div(b.rows, ceil_div(b.rows, b.band_rows));
  b.positions = round_up(b.band_rows * b.band_columns, position_tile);
  b.line = 2 * round_up(b.band_columns, position_tile) + 2;
  return b;
}

// Most channels of a backward-weights group, in panels; 0 where not even one fits.
int fitting_channels(WinogradBlocking b, std::size_t local_elements) {
  b.channel_block = 0;
  const std::size_t fixed = b.weight_elements();
  if (fixed >= local_elements) return 0;
  const std::size_t per_channel = WinogradBlocking::frequencies * static_cast<std::size_t>(b.positions + b.chunk);
  const std::size_t fit =
      std::min((local_elements - fixed) / per_channel, static_cast<std::size_t>(most_weights / b.chunk));
  return static_cast<int>(fit) / conv_tile * conv_tile;
}

double time_of_weights(const ConvGeometry& g, const WinogradBlocking& b) {
  const int blocks = ceil_div(g.channels, b.channel_block), shares = ceil_div(g.outputs, b.chunk);
  const double outputs = static_cast<double>(shares) * b.chunk, tiles = static_cast<double>(b.rows) * b.tiles_x;
  const double product = outputs * blocks * round_up(b.channel_block, conv_tile) * tiles;
  const double source = shares * g.channels * vectors_of_rows(b) * b.bands() * transforming;
  const double target = blocks * outputs / vector_outputs * tiles * transforming_target;
  const double sums = static_cast<double>(b.bands()) * outputs * g.channels * summing;
  const double partial = static_cast<double>(b.partials) * outputs * g.channels * adding;
  const double idle = std::max(1.0, static_cast<double>(wanted_groups) / (blocks * shares * b.partials));
  return idle * (product + source + target + sums + partial);
}

}  // namespace

std::size_t WinogradBlocking::weight_sums() const {
  return frequencies * (static_cast<std::size_t>(chunk) * round_up(channel_block, conv_tile) + pad);
}

std::size_t WinogradBlocking::weight_lines() const {
  const int width = std::min(chunk, most_vectors * vector_outputs);
  return std::max(lines(), static_cast<std::size_t>(4 * band_columns) * width);
}

std::size_t WinogradBlocking::lines() const {
  return static_cast<std::size_t>(2 * std::min(band_rows, tiles_y) + 2) * line;
}

bool is_winograd(const ConvGeometry& g) {
  return g.taps_y == 3 && g.taps_x == 3 && g.source_step == 1 && g.target_step == 1;
}

bool prefers_winograd(const ConvGeometry& g) {
  return is_winograd(g) && g.channels >= fewest_channels && g.outputs >= fewest_outputs &&
         g.positions() >= fewest_positions;
}

std::size_t winograd_elements(const ConvGeometry& g) {
  return WinogradBlocking::frequencies *
         (static_cast<std::size_t>(round_up(g.outputs, conv_tile)) * g.channels + WinogradBlocking::pad);
}

std::optional<WinogradBlocking> block_winograd(const ConvGeometry& g, int batch, std::size_t local_elements,
                                               int units) {
  std::optional<WinogradBlocking> best;
  double least = 0;
  const int panels = ceil_div(g.outputs, conv_tile);
  for (int wanted = most_positions; wanted >= position_tile; wanted -= position_tile) {
    WinogradBlocking b = cut_bands(g, batch, wanted);
    for (int chunks = 1; chunks <= panels; ++chunks) {
      b.chunk = ceil_div(panels, chunks) * conv_tile;
      b.channel_block = 0;
      if (b.elements() >= local_elements) continue;
      const std::size_t per_channel = WinogradBlocking::frequencies * static_cast<std::size_t>(b.positions);
      const int fit = static_cast<int>((local_elements - b.elements()) / per_channel);
      if (fit < 1) continue;
      b.channel_block = ceil_div(g.channels, ceil_div(g.channels, fit));
      const double time = time_of(g, b, units);
      if (!best || time < least) least = time, best = b;
    }
  }
  return best;
}

bool prefers_winograd_weights(const ConvGeometry& g, int batch) {
  return is_winograd(g) && g.channels >= fewest_channels && g.outputs >= fewest_outputs &&
         static_cast<long>(g.positions()) * batch >= fewest_positions;
}

std::optional<WinogradBlocking> block_winograd_weights(const ConvGeometry& g, int batch, std::size_t local_elements) {
  std::optional<WinogradBlocking> best;
  double least = 0;
  const int vectors = ceil_div(g.outputs, vector_outputs);
  for (int wanted = most_positions; wanted >= position_tile; wanted -= position_tile) {
    WinogradBlocking b = cut_bands(g, batch, wanted);
    const int most = std::min(most_partials(g), b.bands());
    for (int chunks = 1; chunks <= vectors; chunks *= 2) {
      b.chunk = ceil_div(vectors, chunks) * vector_outputs;
      const int fit = fitting_channels(b, local_elements), shares = ceil_div(g.outputs, b.chunk);
      if (fit < 1) continue;
      for (int partials = 1; partials <= most; partials = partials < most ? std::min(2 * partials, most) : most + 1) {
        const int blocks = std::max(ceil_div(g.channels, fit), ceil_div(wanted_groups, partials * shares));
        b.channel_block = round_up(ceil_div(g.channels, blocks), conv_tile);
        b.partials = partials;
        const double time = time_of_weights(g, b);
        if (!best || time < least) least = time, best = b;
      }
    }
  }
  return best;
}

}  // namespace clerestory
