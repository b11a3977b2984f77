// Two-dimensional convolution (cross-correlation), its adjoints, and which kernels run them.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Which kernels run: ByPlan, those of Launch::gemm ("packed" has bodies for CPUs, direct or by minimal filtering, and
/// one for GPUs, chosen by the device's type and the shape); the others name them, for tests and comparisons. Winograd
/// is for passes of 3x3 taps and stride one; others are then computed directly.
enum class ConvKernels { ByPlan, Cpu, Winograd, Gpu, Clblast };

struct ConvSpec {
  int stride = 1;  // along both axes
  int pad = 0;     // zeros around the picture
  ConvKernels kernels = ConvKernels::ByPlan;
  int scratch =
      0;  // elements of local memory that nn/conv_cpu.cl may use; 0: half a usual L2 cache, if the device has it
};

/// y[n,o,y,x] = bias[o] + sum over i, ky, kx of w[o,i,ky,kx] * x[n,i, y*stride + ky - pad, x*stride + kx - pad].
/// x {N,I,H,W}, w {O,I,KH,KW}, bias {1,O,1,1} or empty; the result is {N, O, (H + 2 pad - KH)/stride + 1, ...}.
/// Backends: "packed" (implicit GEMM, nn/conv_cpu.cl or nn/conv_gpu.cl; minimal filtering, nn/conv_winograd.cl, where
/// that is faster), "direct" (the same without minimal filtering) and "clblast" (im2col and CLBlast). All sum in a
/// fixed order.
Value conv(Value x, Value w, Value bias, const ConvSpec& spec = {});

/// Channels of x normalised before the convolution, as normalise_channels(x, moments, gamma, beta, relu, epsilon) does
/// it (host/ops/nn/batch_norm.hpp): DenseNet's order.
struct ConvNorm {
  Value moments, gamma, beta;
  bool relu = true;
  double epsilon = 1e-5;
};
/// conv(normalise_channels(x, ...), w, bias, spec), while the normalised tensor exists in no memory: it is computed
/// where it is read, in this pass and in backward weights.
Value conv(Value x, const ConvNorm& norm, Value w, Value bias, const ConvSpec& spec = {});

}  // namespace clerestory
