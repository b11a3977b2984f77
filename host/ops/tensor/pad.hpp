// Padding of planes by replication (kernels/tensor/pad.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

struct Padding {
  int top = 0, bottom = 0, left = 0, right = 0;
};

Value pad_replicate(Value x, const Padding& padding);

}  // namespace clerestory
