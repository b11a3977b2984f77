// Weights of small fully connected nets as the kernels that run a whole net read them (kernels/light/pack_layer.cl).
#pragma once
#include "host/graph/op.hpp"

namespace clerestory {

/// Elements that a layer takes.
std::size_t packed_elements(int in, int out);

/// Packs weight {out, in, 1, 1} and, if not null, bias {1, out, 1, 1} to `at` elements into the workspace; the end of
/// it.
std::size_t pack_layer(Launch& launch, const TensorView& weight, const TensorView* bias, std::size_t at);
/// The same of its transpose, without a bias.
std::size_t pack_transposed(Launch& launch, const TensorView& weight, std::size_t at);

/// Throws Error unless weight is {out, in, 1, 1} and bias, where there is one, {1, out, 1, 1}.
void check_layer(const Value& weight, const Value& bias, int in, int out, const char* op);

/// How the kernels of light/mlp.clh are built and launched.
Defines net_defines(Device& device);
Range net_range(const Device& device, long rays);

}  // namespace clerestory
