#include "nets/densenet.hpp"

#include "host/ops/nn/pool.hpp"
#include "host/ops/tensor/concat.hpp"

namespace clerestory {
namespace {

constexpr int kBottleneck = 4;  // times growth

/// BN, ReLU, 1x1, BN, ReLU, 3x3.
Value dense_layer(const Scope& scope, const Feature& x, int growth) {
  const Value narrow = norm_conv_layer(scope / "norm1", scope / "conv1", x, kBottleneck * growth, 1, 1, 0);
  return norm_conv_layer(scope / "norm2", scope / "conv2", feature_of(scope, narrow), growth, 3, 1, 1);
}

Feature dense_block(const Scope& scope, Feature x, int layers, int growth) {
  for (int i = 1; i <= layers; ++i) {
    const Feature made = feature_of(scope, dense_layer(scope / fmt::format("denselayer{}", i), x, growth));
    x.value = concat(std::array{x.value, made.value});
    if (scope.training) x.moments = concat(std::array{x.moments, made.moments});
  }
  return x;
}

/// BN, ReLU, 1x1 to half the channels, 2x2 average.
Value transition(const Scope& scope, const Feature& x) {
  return average_pool(norm_conv_layer(scope / "norm", scope / "conv", x, x.value.shape().c / 2, 1, 1, 0));
}

}  // namespace

std::array<Value, 5> densenet(const Scope& parent, Value image, const DensenetSize& size) {
  const Scope scope = parent / "features";
  std::array<Value, 5> levels;
  const Value first = conv_layer(scope / "conv0", image, size.first, 7, 2, 3);
  levels[0] = batch_norm_layer(scope / "norm0", feature_of(scope, first), true);
  for (int b = 1; b <= 4; ++b) {
    const Feature block =
        dense_block(scope / fmt::format("denseblock{}", b), feature_of(scope, levels[static_cast<std::size_t>(b - 1)]),
                    size.layers[static_cast<std::size_t>(b - 1)], size.growth);
    levels[static_cast<std::size_t>(b)] = b < 4 ? transition(scope / fmt::format("transition{}", b), block)
                                                : batch_norm_layer(scope / "norm5", block, false);
  }
  return levels;
}

}  // namespace clerestory
