// What a plan runs and in which order, before anything has a place in memory. Private to host/graph.
#pragma once
#include <compare>
#include <vector>

#include "host/graph/plan.hpp"

namespace clerestory {

inline std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// One output of a task.
struct TaskValue {
  int task = 0, output = 0;
  auto operator<=>(const TaskValue&) const = default;
};

/// A node to run, with what it reads: outputs of other tasks.
struct Task {
  const Node* node = nullptr;
  std::vector<TaskValue> inputs;
};

struct Schedule {
  std::vector<Task> tasks;          // the node of id i is task i; what is given and what runs once more come behind
  std::vector<const Node*> leaves;  // inputs, states and constants that somebody reads
  std::vector<int> order;           // tasks that run; leaves do not
  std::vector<TaskValue> outputs;

  const Signature& signature(TaskValue v) const {
    return tasks[static_cast<std::size_t>(v.task)].node->outputs[static_cast<std::size_t>(v.output)];
  }
  bool leaf(int task) const;
  /// By task: its place in the order, -1 for those that do not run.
  std::vector<int> positions() const;
};

std::size_t bytes_of(const Signature& s, Precision precision);

/// By task: the state whose memory its output 0 is, as a state or as a view of one; -1 for others.
std::vector<int> seen_states(const Schedule& schedule);

/// A value that is not computed, and the node, an input, that stands for it.
struct Given {
  Value value;
  const Node* input = nullptr;
};

/// Nodes that the outputs need, in the order in which they were made; updates of states last, if `updates`. The k-th of
/// `given` is a task behind those of the graph's nodes.
Schedule schedule_as_made(const Graph& graph, const std::vector<Value>& outputs, bool prune, bool updates,
                          std::span<const Given> given = {});

/// The same, but of what can run the node that was made last runs first: a branch of the graph runs forward, and
/// backward as soon as its loss is known, before the next branch begins; an update runs when nobody reads what it
/// writes over.
Schedule last_made_first(Schedule schedule);

/// The same, but what makes more memory than it gives back waits until it is read.
Schedule when_read(Schedule schedule, Precision precision);

}  // namespace clerestory
