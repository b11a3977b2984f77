// Functions of one number (kernels/nn/activation.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

enum class Function { Relu, Unit, SignedUnit, Exp, Log, Softplus, Square, Log1p, Relu6 };

Value activate(Value x, Function function);
inline Value relu(Value x) { return activate(x, Function::Relu); }

}  // namespace clerestory
