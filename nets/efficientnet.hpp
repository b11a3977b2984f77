// EfficientNet-Lite (Tan and Le 2019, arXiv 1905.11946; "Lite": ReLU6 and no squeeze-and-excitation) as a feature
// trunk: inverted residuals of 1x1, depthwise and 1x1 convolutions. Batch normalisations are folded into the
// convolutions before them, so that weights learned on ImageNet can be read (nets/weights/imagenet_lite0.safetensors)
// and a step has no statistics.
#pragma once
#include <array>

#include "nets/builder.hpp"

namespace clerestory {

struct EfficientnetSize {
  std::array<int, 7> channels = {16, 24, 40, 80, 112, 192, 320};  // of the stages' blocks
  std::array<int, 7> layers = {1, 2, 2, 3, 3, 4, 1};              // blocks of the stages
};

/// Features at 1/2, 1/4, 1/8, 1/16 and 1/32 of the input, rounded up: after the first, second, third, fifth and last
/// stage. `image`: display-coded, from -1 to 1, {n, 3, h, w}.
std::array<Value, 5> efficientnet(const Scope& scope, Value image, const EfficientnetSize& size);

}  // namespace clerestory
