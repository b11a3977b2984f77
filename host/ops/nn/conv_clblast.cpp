// The CLBlast backend: im2col of as many channels as fit into a bounded workspace, then products, those of items with
// small planes in one call.
#include <clblast.h>

#include <algorithm>

#include "host/ops/nn/clblast_parameters.hpp"
#include "host/ops/nn/conv_backend.hpp"

namespace clerestory {
namespace {

constexpr std::size_t columns_budget = 4u
                                       << 20;  // elements of im2col matrix held at once, if one channel needs no more
// Largest plane whose items are multiplied in one call. On two cores of a CPU, batch 8, that call takes 0.68 to 0.96 of
// the time of one call an item up to here, 0.97 to 1.06 beyond. CLBlast's Convgemm takes 1.3 to 3 times as long as
// im2col and products.
constexpr long batched_positions = 512;

std::size_t per_channel(const ConvGeometry& g) { return static_cast<std::size_t>(g.taps()) * g.positions(); }

// The source is the im2col matrix already.
bool is_plain_product(const ConvGeometry& g, bool normalised) {
  return !normalised && g.taps() == 1 && g.source_step == 1 && g.positions() == g.source_plane;
}

int channels_at_once(const ConvGeometry& g, bool normalised) {
  if (is_plain_product(g, normalised)) return g.channels;
  return static_cast<int>(std::clamp<std::size_t>(columns_budget / per_channel(g), 1, g.channels));
}

// All channels of each, where there are several.
int items_at_once(const ConvGeometry& g, bool normalised, int batch) {
  if (g.positions() > batched_positions || channels_at_once(g, normalised) < g.channels) return 1;
  if (is_plain_product(g, normalised)) return batch;
  return static_cast<int>(std::clamp<std::size_t>(columns_budget / (per_channel(g) * g.channels), 1, batch));
}

template <class T>
clblast::StatusCode gemm(Launch& l, int rows, int columns, int depth, const MatrixView& a, const MatrixView& b,
                         double beta, const MatrixView& c, int items) {
  const auto transpose = [](const MatrixView& m) {
    return m.transposed ? clblast::Transpose::kYes : clblast::Transpose::kNo;
  };
  cl_command_queue queue = l.device.queue();
  if (items > 1)
    return clblast::GemmStridedBatched<T>(
        clblast::Layout::kRowMajor, transpose(a), transpose(b), rows, columns, depth, T(1), a.tensor.buffer.handle(),
        a.tensor.offset + a.at, a.pitch, a.stride, b.tensor.buffer.handle(), b.tensor.offset + b.at, b.pitch, b.stride,
        T(beta), c.tensor.buffer.handle(), c.tensor.offset + c.at, c.pitch, c.stride, items, &queue, nullptr);
  return clblast::Gemm<T>(clblast::Layout::kRowMajor, transpose(a), transpose(b), rows, columns, depth, T(1),
                          a.tensor.buffer.handle(), a.tensor.offset + a.at, a.pitch, b.tensor.buffer.handle(),
                          b.tensor.offset + b.at, b.pitch, T(beta), c.tensor.buffer.handle(), c.tensor.offset + c.at,
                          c.pitch, &queue, nullptr);
}

// Calls body(part geometry, first channel, first item, items) for each run of channels or items that is unrolled at
// once; only the first run of an item's channels begins at 0.
template <class Body>
void for_columns(const ConvGeometry& forward, bool normalised, int batch, const Body& body) {
  const int step = channels_at_once(forward, normalised), together = items_at_once(forward, normalised, batch);
  for (int n = 0; n < batch; n += together)
    for (int first = 0; first < forward.channels; first += step) {
      ConvGeometry g = forward;
      g.channels = std::min(step, forward.channels - first);
      body(g, first, n, std::min(together, batch - n));
    }
}

std::uint64_t stride_of(const TensorView& t) { return static_cast<std::uint64_t>(t.stride); }
std::uint64_t item(const TensorView& t, int n) { return static_cast<std::uint64_t>(n) * stride_of(t); }

// The workspace behind the im2col matrices of `items`.
TensorView columns_at(const Launch& l, const ConvGeometry& g, int items) {
  TensorView columns = l.workspace;
  columns.offset += static_cast<std::uint64_t>(items) * per_channel(g) * static_cast<std::uint64_t>(g.channels);
  return columns;
}

// The im2col matrices of some channels of items from n on: in the workspace, or the source itself where it is one
// already.
MatrixView columns_of(Launch& l, const ConvGeometry& g, const TensorView& x, const SourceNorm* norm, int n, int items,
                      int first) {
  const int positions = static_cast<int>(g.positions());
  if (is_plain_product(g, norm != nullptr)) return {x, item(x, n), positions, false, stride_of(x)};
  const Range range = Range::of2(static_cast<std::size_t>(positions), static_cast<std::size_t>(g.depth()));
  for (int i = 0; i < items; ++i)
    with_source(norm, [&](const Defines& defines, const auto&... map) {
      l.run_with(defines, "nn/im2col.cl", "im2col", range, x, map..., columns_at(l, g, i), g, n + i, first);
    });
  return {l.workspace, 0, positions, false, per_channel(g) * static_cast<std::uint64_t>(g.channels)};
}

}  // namespace

void clblast_gemm(Launch& l, int rows, int columns, int depth, const MatrixView& a, const MatrixView& b, double beta,
                  const MatrixView& c, int items) {
  use_tuned_parameters(l.device);
  const clblast::StatusCode status = l.precision == Precision::Double
                                         ? gemm<double>(l, rows, columns, depth, a, b, beta, c, items)
                                         : gemm<float>(l, rows, columns, depth, a, b, beta, c, items);
  if (status != clblast::StatusCode::kSuccess)
    throw Error(ErrorKind::Device,
                fmt::format("CLBlast failed on a product of {}x{} by {}x{}", rows, depth, depth, columns),
                l.device.info().name, fmt::format("status {}", static_cast<int>(status)));
}

std::size_t columns_elements(const ConvGeometry& forward, bool normalised, int batch) {
  if (is_plain_product(forward, normalised)) return 0;
  return static_cast<std::size_t>(items_at_once(forward, normalised, batch)) * channels_at_once(forward, normalised) *
         per_channel(forward);
}

void run_clblast_forward(Launch& l, const ConvGeometry& forward, int batch, const TensorView& x, const SourceNorm* norm,
                         const TensorView& w, const TensorView* bias, const TensorView& y) {
  const int positions = static_cast<int>(forward.positions());
  if (bias) {
    const Range range{{static_cast<std::size_t>(positions), static_cast<std::size_t>(forward.outputs),
                       static_cast<std::size_t>(batch)},
                      {64, 1, 1}};
    l.run("nn/conv_pack.cl", "conv_fill_bias", range, *bias, y, positions);
  }
  for_columns(forward, norm != nullptr, batch, [&](const ConvGeometry& g, int first, int n, int items) {
    clblast_gemm(l, g.outputs, positions, g.depth(), {w, static_cast<std::uint64_t>(first) * g.taps(), item_pitch(w)},
                 columns_of(l, g, x, norm, n, items, first), bias || first > 0 ? 1 : 0,
                 {y, item(y, n), positions, false, stride_of(y)}, items);
  });
}

void run_clblast_data(Launch& l, const ConvGeometry& forward, int batch, const TensorView& dy, const TensorView& w,
                      const TensorView& dx) {
  const int positions = static_cast<int>(forward.positions());
  for_columns(forward, false, batch, [&](const ConvGeometry& g, int first, int n, int items) {
    const MatrixView columns =
        is_plain_product(g, false)
            ? MatrixView{dx, item(dx, n), positions, false, stride_of(dx)}
            : MatrixView{l.workspace, 0, positions, false, per_channel(g) * static_cast<std::uint64_t>(g.channels)};
    clblast_gemm(l, g.depth(), positions, g.outputs,
                 {w, static_cast<std::uint64_t>(first) * g.taps(), item_pitch(w), true},
                 {dy, item(dy, n), positions, false, stride_of(dy)}, 0, columns, items);
    if (is_plain_product(g, false)) return;
    for (int i = 0; i < items; ++i)
      l.run("nn/im2col.cl", "col2im",
            Range::of2(static_cast<std::size_t>(g.source_plane), static_cast<std::size_t>(g.channels)),
            columns_at(l, g, i), dx, g, n + i, first);
  });
}

// The products of a batch are a sum, so each is a call.
void run_clblast_weights(Launch& l, const ConvGeometry& forward, int batch, const TensorView& x, const SourceNorm* norm,
                         const TensorView& dy, const TensorView& dw) {
  const int positions = static_cast<int>(forward.positions());
  for (int item_at = 0; item_at < batch; ++item_at)
    for_columns(forward, norm != nullptr, 1, [&](const ConvGeometry& g, int first, int, int) {
      MatrixView columns = columns_of(l, g, x, norm, item_at, 1, first);
      columns.transposed = true;
      clblast_gemm(l, g.outputs, g.depth(), positions, {dy, item(dy, item_at), positions}, columns, item_at > 0 ? 1 : 0,
                   {dw, static_cast<std::uint64_t>(first) * g.taps(), item_pitch(dw)});
    });
}

}  // namespace clerestory
