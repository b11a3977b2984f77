// The decoders of MGNet: steps of convolution, group normalisation and ReLU from the encoder's smallest level up to the
// picture's size. One a map, as the paper has it, or one whose steps all maps share.
#pragma once
#include <array>

#include "nets/builder.hpp"

namespace clerestory {

/// Channels of c1..c5, multiples of the groups, which are the paper's whatever the channels.
using DecoderSize = std::array<int, 5>;
inline constexpr DecoderSize kDecoderGroups{32, 16, 16, 8, 4};

/// `levels` are the encoder's at 1/2, 1/4, 1/8, 1/16, 1/16; the result is {n, channels, height, width}, before any
/// output activation. Up-sampling (bilinear, corners aligned) acts on the concatenation; where a size disagrees with
/// the skip's, the feature is resized to it.
Value decoder(const Scope& scope, const std::array<Value, 5>& levels, const DecoderSize& size, int channels, int height,
              int width);

/// Channels of c1..c5, at the encoder's sizes, and of the last step at the picture's: multiples of a group's.
using SharedDecoderSize = std::array<int, 6>;
inline constexpr int kSharedGroup = 8;

/// {n, size[5], h, w}, what `map_head` reads, with h x w those of `picture`. A step convolves at the size of its skip,
/// before the next enlarges, where `decoder` enlarges first: a quarter of the work. What that loses of edges the last
/// step finds in the picture, which it is given again.
Value shared_decoder(const Scope& scope, const std::array<Value, 5>& levels, const SharedDecoderSize& size,
                     Value picture);
/// A map of `channels`, before any output activation: one convolution over replicated borders.
Value map_head(const Scope& scope, Value features, int channels);

}  // namespace clerestory
