// The CLBlast backend: im2col of as many channels as fit into a bounded workspace, then a product per batch item.
#include <clblast.h>

#include <algorithm>

#include "host/ops/nn/clblast_parameters.hpp"
#include "host/ops/nn/conv_backend.hpp"

namespace clerestory {
namespace {

constexpr std::size_t columns_budget = 4u
                                       << 20;  // elements of im2col matrix held at once, if one channel needs no more

std::size_t per_channel(const ConvGeometry& g) { return static_cast<std::size_t>(g.taps()) * g.positions(); }

// The source is the im2col matrix already.
bool is_plain_product(const ConvGeometry& g, bool normalised) {
  return !normalised && g.taps() == 1 && g.source_step == 1 && g.positions() == g.source_plane;
}

int channels_at_once(const ConvGeometry& g, bool normalised) {
  if (is_plain_product(g, normalised)) return g.channels;
  return static_cast<int>(std::clamp<std::size_t>(columns_budget / per_channel(g), 1, g.channels));
}

template <class T>
clblast::StatusCode gemm(Launch& l, int rows, int columns, int depth, const MatrixView& a, const MatrixView& b,
                         double beta, const MatrixView& c) {
  const auto transpose = [](const MatrixView& m) {
    return m.transposed ? clblast::Transpose::kYes : clblast::Transpose::kNo;
  };
  cl_command_queue queue = l.device.queue();
  return clblast::Gemm<T>(clblast::Layout::kRowMajor, transpose(a), transpose(b), rows, columns, depth, T(1),
                          a.tensor.buffer.handle(), a.tensor.offset + a.at, a.pitch, b.tensor.buffer.handle(),
                          b.tensor.offset + b.at, b.pitch, T(beta), c.tensor.buffer.handle(), c.tensor.offset + c.at,
                          c.pitch, &queue, nullptr);
}

// Calls body(part geometry, first channel) for each run of channels that is unrolled at once.
template <class Body>
void for_channels(const ConvGeometry& forward, bool normalised, const Body& body) {
  const int step = channels_at_once(forward, normalised);
  for (int first = 0; first < forward.channels; first += step) {
    ConvGeometry g = forward;
    g.channels = std::min(step, forward.channels - first);
    body(g, first);
  }
}

std::uint64_t item(const TensorView& t, int n) {
  return static_cast<std::uint64_t>(n) * static_cast<std::uint64_t>(t.stride);
}

// The im2col matrix of some channels of item n: in the workspace, or the source itself where it is one already.
MatrixView columns_of(Launch& l, const ConvGeometry& g, const TensorView& x, const SourceNorm* norm, int n, int first) {
  const int positions = static_cast<int>(g.positions());
  if (is_plain_product(g, norm != nullptr)) return {x, item(x, n), positions};
  const Range range = Range::of2(static_cast<std::size_t>(positions), static_cast<std::size_t>(g.depth()));
  with_source(norm, [&](const Defines& defines, const auto&... map) {
    l.run_with(defines, "nn/im2col.cl", "im2col", range, x, map..., l.workspace, g, n, first);
  });
  return {l.workspace, 0, positions};
}

}  // namespace

void clblast_gemm(Launch& l, int rows, int columns, int depth, const MatrixView& a, const MatrixView& b, double beta,
                  const MatrixView& c) {
  use_tuned_parameters(l.device);
  const clblast::StatusCode status = l.precision == Precision::Double
                                         ? gemm<double>(l, rows, columns, depth, a, b, beta, c)
                                         : gemm<float>(l, rows, columns, depth, a, b, beta, c);
  if (status != clblast::StatusCode::kSuccess)
    throw Error(ErrorKind::Device,
                fmt::format("CLBlast failed on a product of {}x{} by {}x{}", rows, depth, depth, columns),
                l.device.info().name, fmt::format("status {}", static_cast<int>(status)));
}

std::size_t columns_elements(const ConvGeometry& forward, bool normalised) {
  return is_plain_product(forward, normalised) ? 0 : channels_at_once(forward, normalised) * per_channel(forward);
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
  for (int n = 0; n < batch; ++n)
    for_channels(forward, norm != nullptr, [&](const ConvGeometry& g, int first) {
      clblast_gemm(l, g.outputs, positions, g.depth(), {w, static_cast<std::uint64_t>(first) * g.taps(), item_pitch(w)},
                   columns_of(l, g, x, norm, n, first), bias || first > 0 ? 1 : 0, {y, item(y, n), positions});
    });
}

void run_clblast_data(Launch& l, const ConvGeometry& forward, int batch, const TensorView& dy, const TensorView& w,
                      const TensorView& dx) {
  const int positions = static_cast<int>(forward.positions());
  for (int n = 0; n < batch; ++n)
    for_channels(forward, false, [&](const ConvGeometry& g, int first) {
      const bool plain = is_plain_product(g, false);
      clblast_gemm(l, g.depth(), positions, g.outputs,
                   {w, static_cast<std::uint64_t>(first) * g.taps(), item_pitch(w), true}, {dy, item(dy, n), positions},
                   0, {plain ? dx : l.workspace, plain ? item(dx, n) : 0, positions});
      if (!plain)
        l.run("nn/im2col.cl", "col2im",
              Range::of2(static_cast<std::size_t>(g.source_plane), static_cast<std::size_t>(g.channels)), l.workspace,
              dx, g, n, first);
    });
}

void run_clblast_weights(Launch& l, const ConvGeometry& forward, int batch, const TensorView& x, const SourceNorm* norm,
                         const TensorView& dy, const TensorView& dw) {
  const int positions = static_cast<int>(forward.positions());
  for (int n = 0; n < batch; ++n)
    for_channels(forward, norm != nullptr, [&](const ConvGeometry& g, int first) {
      MatrixView columns = columns_of(l, g, x, norm, n, first);
      columns.transposed = true;
      clblast_gemm(l, g.outputs, g.depth(), positions, {dy, item(dy, n), positions}, columns, n > 0 ? 1 : 0,
                   {dw, static_cast<std::uint64_t>(first) * g.taps(), item_pitch(dw)});
    });
}

}  // namespace clerestory
