#include "nets/decoder.hpp"

#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/pad.hpp"
#include "host/ops/tensor/resize.hpp"

namespace clerestory {
namespace {

constexpr std::array<int, 5> kGroups{32, 16, 16, 8, 4};

Value step(const Scope& scope, Value x, int channels, int groups) {
  const Value y = conv_bias_layer(scope / "conv", x, channels, 3, 1, 1);
  return group_norm_relu_layer(scope / "norm", y, groups);
}

}  // namespace

Value decoder(const Scope& scope, const std::array<Value, 5>& levels, const DecoderSize& size, int channels, int height,
              int width) {
  Value x = step(scope / "c1", levels[4], size[0], kGroups[0]);
  for (std::size_t i = 1; i < 5; ++i) {
    const Value skip = levels[4 - i];
    const int h = skip.shape().h, w = skip.shape().w;
    // Up-sampling acts on each channel by itself: the parts are written straight into the concatenation.
    const Value larger = concat(
        std::array{resize_bilinear(resize_bilinear(x, h, w), 2 * h, 2 * w), resize_bilinear(skip, 2 * h, 2 * w)});
    x = step(scope / fmt::format("c{}", i + 1), larger, size[i], kGroups[i]);
  }
  x = pad_replicate(resize_bilinear(x, height, width), {1, 1, 1, 1});
  return conv_bias_layer(scope / "out", x, channels, 3, 1, 0);
}

}  // namespace clerestory
