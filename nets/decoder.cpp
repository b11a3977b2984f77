#include "nets/decoder.hpp"

#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/pad.hpp"
#include "host/ops/tensor/resize.hpp"

namespace clerestory {
namespace {

Value step(const Scope& scope, Value x, int channels, int groups) {
  const Value y = conv_bias_layer(scope / "conv", x, channels, 3, 1, 1);
  return group_norm_relu_layer(scope / "norm", y, groups);
}

}  // namespace

Value decoder(const Scope& scope, const std::array<Value, 5>& levels, const DecoderSize& size, int channels, int height,
              int width) {
  Value x = step(scope / "c1", levels[4], size[0], kDecoderGroups[0]);
  for (std::size_t i = 1; i < 5; ++i) {
    const Value skip = levels[4 - i];
    const int h = skip.shape().h, w = skip.shape().w;
    // Up-sampling acts on each channel by itself: the parts are written straight into the concatenation.
    const Value larger = concat(
        std::array{resize_bilinear(resize_bilinear(x, h, w), 2 * h, 2 * w), resize_bilinear(skip, 2 * h, 2 * w)});
    x = step(scope / fmt::format("c{}", i + 1), larger, size[i], kDecoderGroups[i]);
  }
  return map_head(scope, resize_bilinear(x, height, width), channels);
}

Value shared_decoder(const Scope& scope, const std::array<Value, 5>& levels, const SharedDecoderSize& size,
                     Value picture) {
  const auto shared_step = [&](std::size_t i, Value x) {
    return step(scope / fmt::format("c{}", i + 1), x, size[i], size[i] / kSharedGroup);
  };
  const auto beside = [](Value x, Value larger) {
    return concat(std::array{resize_bilinear(x, larger.shape().h, larger.shape().w), larger});
  };
  Value x = shared_step(0, levels[4]);
  for (std::size_t i = 1; i < 5; ++i) x = shared_step(i, beside(x, levels[4 - i]));
  return shared_step(5, beside(x, picture));
}

Value map_head(const Scope& scope, Value features, int channels) {
  return conv_bias_layer(scope / "out", pad_replicate(features, {1, 1, 1, 1}), channels, 3, 1, 0);
}

}  // namespace clerestory
