// Positional encoding of what an MLP reads (kernels/nn/encode.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// x {n, C, h, w}, frequencies {m, C, 1, 1} in cycles per unit -> {n, 2 m, h, w}: sines of 2 pi B x, then cosines.
/// The gradient goes to x alone.
Value encode(Value x, Value frequencies);

/// Frequencies of `octaves` octaves for each of `channels` numbers: 1/2, 1, 2, ... cycles per unit (Mildenhall et al.
/// 2020), {channels * octaves, channels, 1, 1}.
Tensor octave_frequencies(int channels, int octaves);

}  // namespace clerestory
