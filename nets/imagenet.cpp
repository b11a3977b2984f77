#include "nets/imagenet.hpp"

#include "host/ops/nn/activation.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory {

Value display_coded(Value radiance) {
  constexpr double floor = 1e-3, gamma = 2.2;
  return activate(affine(activate(affine(radiance, 1, floor), Function::Log), 1 / gamma), Function::Exp);
}

Value imagenet_normalised(Value picture) {
  const auto by_channel = [&](double red, double green, double blue) {
    return picture.graph().constant(Tensor(Shape{1, 3, 1, 1}, std::vector<double>{red, green, blue}));
  };
  const Value centred = subtract(picture, by_channel(0.485, 0.456, 0.406));
  return multiply(centred, by_channel(1 / 0.229, 1 / 0.224, 1 / 0.225));
}

}  // namespace clerestory
