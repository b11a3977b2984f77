// The geometry of a convolution's passes and how the CPU bodies cut it: kernels/nn/conv_geometry.clh on the host, which
// explains every field.
#pragma once
#include <cstddef>
#include <vector>

namespace clerestory {

struct ConvGeometry {
  int channels = 0, outputs = 0;
  int source_w = 0, target_w = 0;
  int source_plane = 0, target_plane = 0;
  int grid_h = 0, grid_w = 0;
  int taps_y = 1, taps_x = 1;
  int source_step = 1, source_y = 0, source_x = 0;
  int target_step = 1, target_y = 0, target_x = 0;

  int taps() const { return taps_y * taps_x; }
  int depth() const { return channels * taps(); }
  long positions() const { return static_cast<long>(grid_h) * grid_w; }
};
static_assert(sizeof(ConvGeometry) == 64);

struct ConvBlocking {
  int band_rows = 1, band_columns = 1;
  int bands = 1, bands_x = 1;
  int pitch = 0, subplane = 0, plane = 0;
  int positions = 0;
  int channel_block = 1, chunk = 8;
  int partials = 1, stack = 1, batch = 1;
};
static_assert(sizeof(ConvBlocking) == 52);

/// Outputs per panel of packed weights.
constexpr int conv_tile = 8;

/// A convolution as stored: {outputs, channels, kernel_h, kernel_w} weights on a {height, width} picture.
struct ConvShape {
  int channels = 0, height = 0, width = 0;
  int outputs = 0, kernel_h = 1, kernel_w = 1;
  int stride = 1, pad = 0;
  int weights_pitch = 0;  // elements between the weights of two outputs

  int out_height() const { return (height + 2 * pad - kernel_h) / stride + 1; }
  int out_width() const { return (width + 2 * pad - kernel_w) / stride + 1; }
};

/// Where conv_pack.cl finds the tap (ty, tx) of (output, channel) in the stored weights.
struct ConvTaps {
  int output_pitch = 0, channel_pitch = 0, kernel_w = 1;
  int first_y = 0, first_x = 0, step_y = 1, step_x = 1;
};

struct ConvPass {
  ConvGeometry geometry;
  ConvTaps taps;
};

/// The forward pass; also the geometry of backward weights.
ConvPass forward_pass(const ConvShape& shape);
/// Backward data: stride^2 passes, one per residue of the input pixel; one without taps writes zeros.
std::vector<ConvPass> backward_data_passes(const ConvShape& shape);

/// Cuts a forward or backward-data pass for `units` work-groups at a time with scratch of `local_elements` reals each.
ConvBlocking block_pass(const ConvGeometry& geometry, int batch, std::size_t local_elements, int units);
/// Outputs along one vector of a backward-weights pass, and its groups, whatever the device: how many partial sums
/// there are is part of the result.
inline constexpr int vector_outputs = 16, wanted_groups = 16;
/// Partial sums of a backward-weights pass at most: enough to occupy a few cores when the weights are few.
int most_partials(const ConvGeometry& geometry);
/// Cuts a backward-weights pass.
ConvBlocking block_weights(const ConvGeometry& geometry, int batch, std::size_t local_elements);

/// The form of a backward-weights pass and its scratch, in reals: sums over positions of outer products, whose vectors
/// run over outputs, or dot products over positions where outputs are too few for that.
struct WeightsForm {
  const char* kernel = nullptr;
  std::size_t panel = 0, rows = 0, sums = 0;
  std::size_t elements() const { return panel + rows + sums; }
};
WeightsForm weights_form(const ConvGeometry& geometry, const ConvBlocking& blocking);

}  // namespace clerestory
