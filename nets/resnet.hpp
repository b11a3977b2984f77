// ResNet34 (He et al. 2016) as a feature trunk: states are named as torchvision names them, so its weights can be read.
#pragma once
#include <array>
#include <vector>

#include "nets/builder.hpp"

namespace clerestory {

struct ResnetSize {
  std::array<int, 4> blocks = {3, 4, 6, 3};
  std::array<int, 4> channels = {64, 128, 256, 512};  // of the stages; the first convolution has channels[0]
  int stages = 4;                                     // that are built, 0 to 4
  bool imagenet_input = false;  // the light shows it the picture as nets of ImageNet learned on it (nets/imagenet.hpp)
};

/// Features after the first convolution with its normalisation and ReLU (1/2 of the input, rounded up), and after each
/// stage (1/4, 1/8, ...; the maximum pooling before the first is no level of its own): 1 + stages values.
std::vector<Value> resnet(const Scope& scope, Value image, const ResnetSize& size);

}  // namespace clerestory
