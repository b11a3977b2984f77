#include "nets/vgg.hpp"

#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/pool.hpp"
#include "nets/imagenet.hpp"

namespace clerestory {

Value vgg_features(const Scope& scope, Value image) {
  // Index of each convolution in torchvision's list, and its channels; 0 channels: a pooling.
  constexpr std::pair<int, int> kLayers[]{{0, 64}, {2, 64},   {4, 0},    {5, 128}, {7, 128},
                                          {9, 0},  {10, 256}, {12, 256}, {14, 256}};
  Value x = imagenet_normalised(image);
  for (const auto& [index, channels] : kLayers) {
    if (channels == 0) {
      x = max_pool(x, {.window = 2, .pad = 0});
      continue;
    }
    const Scope layer = scope / "features" / std::to_string(index);
    const Value weight = layer.state("weight", {channels, x.shape().c, 3, 3}, Init::fixed(0));
    const Value bias = layer.state("bias", {1, channels, 1, 1}, Init::fixed(0));
    x = relu(conv(x, weight, bias, {.pad = 1}));
  }
  return x;
}

}  // namespace clerestory
