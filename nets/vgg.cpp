#include "nets/vgg.hpp"

#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/pool.hpp"
#include "nets/imagenet.hpp"

namespace clerestory {

Value vgg_features(const Scope& scope, Value image) {
  // Index of each convolution in torchvision's list, and its channels; 0 channels: a pooling.
  constexpr std::pair<int, int> kLayers[]{{0, 64}, {2, 64},   {4, 0},    {5, 128}, {7, 128},
                                          {9, 0},  {10, 256}, {12, 256}, {14, 256}};
  const Scope frozen{scope.graph, scope.training, scope.name, true};
  Value x = imagenet_normalised(image);
  for (const auto& [index, channels] : kLayers) {
    if (channels == 0) {
      x = max_pool(x, {.window = 2, .pad = 0});
      continue;
    }
    x = relu(conv_shift_layer(frozen / "features" / std::to_string(index), x, channels, 3, 1, 1));
  }
  return x;
}

}  // namespace clerestory
