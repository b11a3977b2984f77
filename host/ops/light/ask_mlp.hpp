// The in-view light's MLP in one kernel: lookup of the hit pixel, Fourier features of the direction, all layers;
// nothing between them goes through memory (kernels/light/ask_mlp.cl). For inference: the same numbers, to rounding, as
// gather_rays, encode and conv together, which have gradients.
#pragma once
#include <vector>

#include "host/ops/light/select_rays.hpp"

namespace clerestory {

inline constexpr int kMostMlpWidth = 512, kMostMlpFrequencies = 256;

/// Weights of an MLP of L hidden layers, each followed by relu, and an output layer. `width` is a multiple of 16, at
/// most kMostMlpWidth.
struct LightMlp {
  Value frequencies;             // {m, 3, 1, 1}, cycles per unit of direction; m at most kMostMlpFrequencies
  std::vector<Value> hidden;     // {width, width, 1, 1} of the layers 1 ... L - 1
  std::vector<Value> direction;  // {width, 2 m, 1, 1} of layer 0 and, with `again`, of that layer
  std::vector<Value> biases;     // {1, width, 1, 1} of the layers 0 ... L - 1
  Value out, out_bias;           // {3, width, 1, 1}, {1, 3, 1, 1}
  int again = 0;                 // the layer that reads the input once more; 0: none
};

/// The last layer's numbers f {1, 3, P, S}, before any output activation; 0 for rays that `list` leaves out and for
/// misses. rows {1, 1, h w, width (2 width with `again`)} by pixel_rows(): layer 0's share first. hit Int {1, 1, P, S}:
/// y * w + x or -1; direction {1, 3, P, S}. A ray's answer does not depend on the other rays. Asking for a gradient
/// throws. Under --gemm clblast the same by products of blocks of rays (host/ops/light/net_layers.hpp).
Value ask_mlp(const LightMlp& mlp, Value rows, Value hit, Value direction, const RayList& list);

}  // namespace clerestory
