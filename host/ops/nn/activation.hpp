// Functions of one number (kernels/nn/activation.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Tangent: tan(0.999 pi x / 2) for x in [0, 1] (Li et al. 2020), at most 636.6.
enum class Function { Relu, Unit, SignedUnit, Exp, Log, Softplus, Square, Log1p, Relu6, Tanh, Tangent };

Value activate(Value x, Function function);
inline Value relu(Value x) { return activate(x, Function::Relu); }

}  // namespace clerestory
