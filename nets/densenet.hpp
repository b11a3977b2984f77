// DenseNet121 (Huang et al. 2017) as a feature trunk, with the first max-pooling left out as Zhu et al. do: states are
// named as torchvision names them, so its weights can be read.
#pragma once
#include <array>

#include "nets/builder.hpp"

namespace clerestory {

struct DensenetSize {
  int growth = 32, first = 64;                  // channels of a dense layer, of the first convolution
  std::array<int, 4> layers = {6, 12, 24, 16};  // of the dense blocks
  bool imagenet_input = false;  // MGNet shows it the picture as nets of ImageNet learned on it (nets/imagenet.hpp)
};

/// Features at 1/2, 1/4, 1/8, 1/16 and 1/16 of the input: after the first convolution, the three transitions, and the
/// last block with its normalisation (no ReLU). For growth 32: 64, 128, 256, 512, 1024 channels.
std::array<Value, 5> densenet(const Scope& scope, Value image, const DensenetSize& size);

}  // namespace clerestory
