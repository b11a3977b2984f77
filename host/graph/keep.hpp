// What chunks have found and their adjoint would compute again is kept for it. Private to host/graph.
#pragma once
#include <deque>

#include "host/graph/schedule.hpp"

namespace clerestory {

/// Has nodes hand what is worth keeping in their bodies to those that replay them, as far as options.keep allows; their
/// tasks then run nodes of `made`. What was kept and what not, for explain().
std::vector<std::string> keep_for_replays(Schedule& schedule, const PlanOptions& options, std::deque<Node>& made);

}  // namespace clerestory
