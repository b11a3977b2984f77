// The gradient of a bias per channel.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// db[c] = sum over n and pixels of dy[n,c]: {1,C,1,1}.
Value conv_bias_gradient(Value dy);

}  // namespace clerestory
