// Memory against time: what is needed early and late but not between is let go and computed again. Private to
// host/graph.
#pragma once
#include "host/graph/layout.hpp"

namespace clerestory {

/// Lets values go, those first that give most bytes for the least work, until no step has more than `goal` bytes alive
/// or nothing helps any more; `layout` is the schedule's, before and after. What runs again is the same node with the
/// same inputs: the same bits and, where it draws, the same draws. Updates never run again.
void recompute(Schedule& schedule, Layout& layout, const PlanOptions& options, std::size_t goal);

}  // namespace clerestory
