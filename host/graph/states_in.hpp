// States of one precision for plans of another.
#pragma once
#include <memory>

#include "host/graph/plan.hpp"

namespace clerestory {

/// The same states, if they are of this precision, else a copy of their values.
std::shared_ptr<States> in_precision(const std::shared_ptr<States>& states, Precision precision);

}  // namespace clerestory
