// Functions of one number (kernels/nn/activation.cl).
#pragma once
#include "host/graph/graph.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory {

/// Tangent: tan(0.999 pi x / 2) for x in [0, 1] (Li et al. 2020), at most 636.6.
enum class Function { Relu, Unit, SignedUnit, Exp, Log, Softplus, Square, Log1p, Relu6, Tanh, Tangent };

Value activate(Value x, Function function);
inline Value relu(Value x) { return activate(x, Function::Relu); }
inline Value clamp_to_unit(Value x) { return affine(relu(affine(relu(x), -1, 1)), -1, 1); }

}  // namespace clerestory
