// Small nets along rays where a BLAS multiplies: layers as matrices in the workspace, a block of rays at a time
// (kernels/light/net_products.cl). What ask_mlp and ask_field do under --gemm clblast, which their one kernel cannot.
#pragma once
#include "host/graph/op.hpp"
#include "host/ops/light/rays.hpp"

namespace clerestory {

inline constexpr const char* kNetProducts = "light/net_products.cl";

/// Whether products were asked of CLBlast by name: where it is left open, one kernel is the faster.
inline bool by_products(const Launch& launch) { return launch.gemm == "clblast" && !launch.small_nets_whole; }

/// How many rays are asked: those of the tile, or as many as `count` says, which is waited for.
int asked_rays(Launch& launch, const RayTile& tile, const TensorView* count);

/// {numbers, columns of the block} at an element of the workspace.
struct WorkMatrix {
  int at = 0, numbers = 0;
};

/// to = bias in each column, and relu of what the layer before left, if there is one.
void begin_layer(Launch& launch, const TensorView& bias, const WorkMatrix& to, const WorkMatrix* before, int columns);
/// to += weight {out, in, 1, 1} times from.
void add_product(Launch& launch, const TensorView& weight, const WorkMatrix& from, const WorkMatrix& to, int columns);

}  // namespace clerestory
