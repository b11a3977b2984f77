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

/// Of programs over light/mlp.clh.
Defines net_defines(Device& device);
/// How a kernel there that carries rays is built and launched. On a GPU a group carries as many rays as it has tiles
/// for in a layer of `width` and local memory for at `numbers` a ray, at most `most`.
struct NetLaunch {
  Defines defines;
  Range range;
  Arg memory;
};
/// Throws ErrorKind::Device when not even four rays fit.
NetLaunch net_launch(Launch& launch, long rays, int width, int numbers, int most = 64);

/// Rows of an activation: outputs come in panels.
int activation_rows(int width);

}  // namespace clerestory
