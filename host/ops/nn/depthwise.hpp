// Convolution of each channel with a kernel of its own (kernels/nn/depthwise.cl): the depthwise convolution of
// MobileNets (Howard et al. 2017).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// y[n,c,j,i] = bias[c] + sum over ky, kx of w[c,0,ky,kx] * x[n, c, stride*j + ky - above, stride*i + kx - left].
/// x {N,C,H,W}, w {C,1,K,K} with K 3 or 5, bias {1,C,1,1}, stride 1 or 2; the result is {N, C, H/stride, W/stride}
/// rounded up. Zeros lie around the picture, those of `same_padding` above and left of it.
Value depthwise(Value x, Value w, Value bias, int stride);

/// Zeros before the first of `size` pixels, where a kernel's outputs are size/stride, rounded up: half of all there
/// are, rounded down (TensorFlow's SAME).
int same_padding(int size, int kernel, int stride);

}  // namespace clerestory
