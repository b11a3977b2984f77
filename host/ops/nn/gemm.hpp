// Matrix products, on the kernels of the convolution: a product is a convolution with one tap.
#pragma once
#include "host/graph/graph.hpp"
#include "host/ops/nn/conv.hpp"

namespace clerestory {

struct MatmulSpec {
  bool transpose_a = false, transpose_b = false;  // not both
  ConvKernels kernels = ConvKernels::ByPlan;
};

/// C = op(A) op(B). Matrices are tensors {1,1,rows,columns} or {rows,columns,1,1}; the result is of A's kind.
Value matmul(Value a, Value b, const MatmulSpec& spec = {});

/// y[n,o] = bias[o] + sum over c of w[o,c] * x[n,c]. x {N,C,1,1}, w {O,C,1,1}, bias {1,O,1,1} or empty.
Value linear(Value x, Value w, Value bias, ConvKernels kernels = ConvKernels::ByPlan);

}  // namespace clerestory
