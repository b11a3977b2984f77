// One over a number, and over its root (kernels/tensor/reciprocal.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

Value reciprocal(Value x);       // 1 / x
Value reciprocal_root(Value x);  // 1 / sqrt(x)

}  // namespace clerestory
