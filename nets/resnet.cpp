#include "nets/resnet.hpp"

#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/pool.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory {
namespace {

/// Convolution without bias, batch normalisation, perhaps ReLU.
Value conv_norm(const Scope& conv, const Scope& norm, Value x, int out, int kernel, int stride, bool relu) {
  const Value y = conv_layer(conv, x, out, kernel, stride, kernel / 2);
  return batch_norm_layer(norm, feature_of(norm, y), relu);
}

/// Two 3x3 convolutions beside the identity, or beside a 1x1 convolution where shapes differ.
Value basic_block(const Scope& scope, Value x, int channels, int stride) {
  const Value first = conv_norm(scope / "conv1", scope / "bn1", x, channels, 3, stride, true);
  const Value second = conv_norm(scope / "conv2", scope / "bn2", first, channels, 3, 1, false);
  const bool same = stride == 1 && x.shape().c == channels;
  const Scope other = scope / "downsample";
  return relu(add(second, same ? x : conv_norm(other / "0", other / "1", x, channels, 1, stride, false)));
}

}  // namespace

std::vector<Value> resnet(const Scope& scope, Value image, const ResnetSize& size) {
  std::vector<Value> levels{conv_norm(scope / "conv1", scope / "bn1", image, size.channels[0], 7, 2, true)};
  for (int stage = 1; stage <= size.stages; ++stage) {
    const auto i = static_cast<std::size_t>(stage - 1);
    Value x = stage == 1 ? max_pool(levels[0]) : levels.back();
    for (int block = 0; block < size.blocks[i]; ++block) {
      const int stride = stage > 1 && block == 0 ? 2 : 1;
      x = basic_block(scope / fmt::format("layer{}.{}", stage, block), x, size.channels[i], stride);
    }
    levels.push_back(x);
  }
  return levels;
}

}  // namespace clerestory
