// Tensors between host and device. Reals convert to and from the device's precision; strided views are handled.
#pragma once
#include "host/graph/op.hpp"
#include "host/graph/tensor.hpp"

namespace clerestory {

void upload(Device& device, const TensorView& to, const Tensor& tensor, Precision precision);
Tensor download(Device& device, const TensorView& from, Precision precision);

}  // namespace clerestory
