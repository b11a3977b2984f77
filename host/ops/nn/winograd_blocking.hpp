// 3x3 convolution of stride one by minimal filtering (kernels/nn/conv_winograd.cl): which passes it is for, and how
// they are cut.
#pragma once
#include <cstddef>
#include <optional>

#include "host/ops/nn/conv_geometry.hpp"

namespace clerestory {

/// kernels/nn/conv_winograd.cl explains every field.
struct WinogradBlocking {
  int tiles_x = 0, tiles_y = 0;
  int band_rows = 1, band_columns = 1;
  int bands_x = 1;
  int positions = 0;
  int channel_block = 1, chunk = 8;
  int rows = 0;
  int line = 0;
  int partials = 1;

  int bands() const { return (rows + band_rows - 1) / band_rows * bands_x; }
  /// Local memory, in reals.
  std::size_t panel() const { return frequencies * (static_cast<std::size_t>(channel_block) * positions + pad); }
  std::size_t sums() const { return frequencies * (static_cast<std::size_t>(chunk) * positions + pad); }
  std::size_t lines() const;
  std::size_t elements() const { return panel() + sums() + lines(); }
  /// Of backward weights: transformed tiles of the target, sums, and rows of the source or of the target.
  std::size_t target_rows() const { return sums(); }
  std::size_t weight_sums() const;
  std::size_t weight_lines() const;
  std::size_t weight_elements() const { return panel() + target_rows() + weight_sums() + weight_lines(); }

  static constexpr std::size_t frequencies = 16, pad = 16;
};
static_assert(sizeof(WinogradBlocking) == 44);

/// Whether minimal filtering can compute a pass, or the backward weights of a forward pass.
bool is_winograd(const ConvGeometry& geometry);
/// Whether it is the faster way, whatever the device and the batch: an item's bits do not depend on the others.
bool prefers_winograd(const ConvGeometry& geometry);
/// Elements of transformed weights.
std::size_t winograd_elements(const ConvGeometry& geometry);
/// Cuts a pass for `units` work-groups at a time with scratch of `local_elements` reals each; nothing where the
/// smallest cut does not fit.
std::optional<WinogradBlocking> block_winograd(const ConvGeometry& geometry, int batch, std::size_t local_elements,
                                               int units);
/// The same of backward weights, whose geometry is that of the forward pass. Whether it is faster hangs on the batch:
/// sums are over all items.
bool prefers_winograd_weights(const ConvGeometry& forward, int batch);
std::optional<WinogradBlocking> block_winograd_weights(const ConvGeometry& forward, int batch,
                                                       std::size_t local_elements);

}  // namespace clerestory
