// Where the values of a schedule live: in memory that they share with what they are views of, are computed in place of
// or are concatenated into, and those pieces in one arena. Private to host/graph.
#pragma once
#include "host/graph/schedule.hpp"

namespace clerestory {

/// A piece of memory and the steps between which somebody needs it.
struct Root {
  std::size_t bytes = 0;
  int first = 0, last = -1;  // positions in the order
  std::vector<TaskValue> members;
};

struct Layout {
  std::vector<std::vector<Placement>> places;  // by task and output
  std::vector<Placement> workspaces;           // by task
  std::vector<Root> roots;
  int gathered = 0, views = 0, in_place = 0;

  const Placement& place(TaskValue v) const {
    return places[static_cast<std::size_t>(v.task)][static_cast<std::size_t>(v.output)];
  }
  /// Bytes that somebody needs, by position.
  std::vector<std::size_t> alive(std::size_t steps) const;
};

Layout lay_out(const Schedule& schedule, const PlanOptions& options);

/// Byte offsets of the roots in an arena, and its size.
struct Packing {
  std::vector<std::size_t> offsets;
  std::size_t bytes = 0;
};
/// Roots that are needed at the same time lie apart; without `reuse` all do.
Packing pack(const std::vector<Root>& roots, bool reuse);

}  // namespace clerestory
