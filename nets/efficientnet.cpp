#include "nets/efficientnet.hpp"

#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/depthwise.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/pad.hpp"

namespace clerestory {
namespace {

constexpr int kStem = 32;  // channels of the first convolution
struct Stage {
  int kernel, stride, expansion;
  int level;  // of the features that it ends, -1: none
};
constexpr std::array<Stage, 7> kStages{
    {{3, 1, 1, 0}, {3, 2, 6, 1}, {5, 2, 6, 2}, {3, 2, 6, -1}, {5, 1, 6, 3}, {5, 2, 6, -1}, {3, 1, 6, 4}}};

Value relu6(Value x) { return activate(x, Function::Relu6); }

/// 3x3, stride 2, ReLU6. Borders are replicated where TensorFlow has zeros: grey, of a display-coded picture.
Value stem(const Scope& scope, Value image) {
  const auto side = [](int size) {
    const int before = same_padding(size, 3, 2);
    return std::pair(before, size % 2 + 1 - before);
  };
  const auto [top, bottom] = side(image.shape().h);
  const auto [left, right] = side(image.shape().w);
  return relu6(conv_shift_layer(scope, pad_replicate(image, {top, bottom, left, right}), kStem, 3, 2, 0));
}

/// 1x1 to `expansion` times the channels, depthwise, 1x1; beside the identity where nothing changes in shape.
Value inverted_residual(const Scope& scope, Value x, int channels, const Stage& stage, int stride) {
  Value y = x;
  if (stage.expansion > 1) y = relu6(conv_shift_layer(scope / "expand", y, stage.expansion * x.shape().c, 1, 1, 0));
  y = relu6(depthwise_layer(scope / "depthwise", y, stage.kernel, stride));
  y = conv_shift_layer(scope / "project", y, channels, 1, 1, 0);
  return stride == 1 && channels == x.shape().c ? add(y, x) : y;
}

}  // namespace

std::array<Value, 5> efficientnet(const Scope& scope, Value image, const EfficientnetSize& size) {
  std::array<Value, 5> levels;
  Value x = stem(scope / "stem", image);
  for (std::size_t s = 0; s < kStages.size(); ++s) {
    const Stage& stage = kStages[s];
    for (int layer = 0; layer < size.layers[s]; ++layer)
      x = inverted_residual(scope / fmt::format("stage{}.{}", s, layer), x, size.channels[s], stage,
                            layer == 0 ? stage.stride : 1);
    if (stage.level >= 0) levels[static_cast<std::size_t>(stage.level)] = x;
  }
  return levels;
}

}  // namespace clerestory
