// The decoder of MGNet's heads: five steps of convolution, group normalisation and ReLU, doubling in size between them.
#pragma once
#include <array>

#include "nets/builder.hpp"

namespace clerestory {

/// Channels of c1..c5; groups are 32-16-16-8-4 whatever the channels.
using DecoderSize = std::array<int, 5>;

/// `levels` are the encoder's at 1/2, 1/4, 1/8, 1/16, 1/16; the result is {n, channels, height, width}, before any
/// output activation. Up-sampling (bilinear, corners aligned) acts on the concatenation; where a size disagrees with
/// the skip's, the feature is resized to it.
Value decoder(const Scope& scope, const std::array<Value, 5>& levels, const DecoderSize& size, int channels, int height,
              int width);

}  // namespace clerestory
