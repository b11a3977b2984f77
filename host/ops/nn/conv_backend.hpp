// The two backends behind convolutions and matrix products, on views: nothing here knows of graphs.
#pragma once
#include <optional>

#include "host/graph/op.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/conv_geometry.hpp"

namespace clerestory {

/// Whether the op at hand runs on CLBlast.
bool use_clblast(const Launch& launch, ConvKernels kernels);
/// Elements between the batch items of a tensor (rows of its matrix of weights).
int item_pitch(const TensorView& tensor);

/// Normalises the source while it is read: nn/conv_geometry.clh's SourceMap.
struct SourceNorm {
  TensorView moments, gamma, beta;
  double epsilon = 0;
  bool relu = false;
};

/// Runs a kernel whose source may be normalised: `run(defines, map arguments...)`.
template <class Run>
void with_source(const SourceNorm* norm, const Run& run) {
  if (norm)
    run(Defines{{"NORMALISE", "1"}}, norm->moments, norm->gamma, norm->beta, Launch::Real{norm->epsilon},
        static_cast<int>(norm->relu));
  else
    run(Defines{});
}

// Packed: our own kernels.

/// Elements of packed weights of a pass, in its workspace.
std::size_t packed_elements(const ConvGeometry& geometry);
/// target = weights * source (+ bias): packs the weights at element `at` of the workspace, then runs the pass.
void run_packed(Launch& launch, const ConvPass& pass, int batch, const ConvSpec& spec, const TensorView& source,
                const SourceNorm* norm, const TensorView& weights, const TensorView* bias, const TensorView& target,
                std::size_t at = 0);

/// Most elements of partial sums that run_packed_weights takes from the workspace.
std::size_t partial_elements(const ConvGeometry& geometry, int batch);
/// gradient[outputs][depth], rows `row_pitch` apart, = sum over positions of target * source under each tap (+ bias of
/// each column).
void run_packed_weights(Launch& launch, const ConvGeometry& geometry, int batch, const ConvSpec& spec,
                        const TensorView& source, const SourceNorm* norm, const TensorView& target,
                        const TensorView* bias, const TensorView& gradient, int row_pitch);

// CLBlast.

/// A matrix in device memory: row-major, or its transpose.
struct MatrixView {
  const TensorView& tensor;
  std::uint64_t at = 0;  // elements from the start of the tensor
  int pitch = 0;         // elements between rows as stored
  bool transposed = false;
  std::uint64_t stride = 0;  // elements to the matrix of the next item
};
/// c = a * b + beta * c, where a is rows x depth and b is depth x columns; of `items` such at once.
void clblast_gemm(Launch& launch, int rows, int columns, int depth, const MatrixView& a, const MatrixView& b,
                  double beta, const MatrixView& c, int items = 1);

/// Most elements of im2col matrices in the workspace, of a batch whose items may be multiplied at once.
std::size_t columns_elements(const ConvGeometry& forward, bool normalised, int batch);
void run_clblast_forward(Launch& launch, const ConvGeometry& forward, int batch, const TensorView& x,
                         const SourceNorm* norm, const TensorView& w, const TensorView* bias, const TensorView& y);
void run_clblast_data(Launch& launch, const ConvGeometry& forward, int batch, const TensorView& dy, const TensorView& w,
                      const TensorView& dx);
void run_clblast_weights(Launch& launch, const ConvGeometry& forward, int batch, const TensorView& x,
                         const SourceNorm* norm, const TensorView& dy, const TensorView& dw);

}  // namespace clerestory
